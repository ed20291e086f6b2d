SELECT event.id
FROM event
WHERE NOT (EXISTS (SELECT 1
FROM part AS link
WHERE link.part_id = event.id AND link.whole_uid != ALL (%(p0)s::UUID[]))) ORDER BY lower(event.period), event.id
