SELECT event.id
FROM event
WHERE NOT (EXISTS (SELECT 1
FROM part
WHERE part.part_id = event.id)) ORDER BY lower(event.period), event.id
