SELECT event.id
FROM event
WHERE NOT (EXISTS (WITH RECURSIVE seen(id) AS
(SELECT part.whole_id AS id
FROM part
WHERE part.part_id = event.id UNION SELECT step.whole_id AS whole_id
FROM part AS step JOIN seen ON step.part_id = seen.id)
 SELECT 1
FROM seen
WHERE seen.id != ALL (array((SELECT other.id
FROM event AS other
WHERE other.uid = ANY (%(p0)s::UUID[])))))) ORDER BY lower(event.period), event.id
