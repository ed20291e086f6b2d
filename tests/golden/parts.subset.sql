SELECT event.id
FROM event
WHERE NOT (EXISTS (SELECT 1
FROM part AS link JOIN event AS other ON other.id = link.part_id
WHERE link.whole_id = event.id AND other.uid != ALL (%(p0)s::UUID[]))) ORDER BY lower(event.period), event.id
