SELECT event.id
FROM event
WHERE NOT (EXISTS (WITH RECURSIVE seen(id) AS
(SELECT part.part_id AS id
FROM part
WHERE part.whole_id = event.id UNION SELECT step.part_id AS part_id
FROM part AS step JOIN seen ON step.whole_id = seen.id)
 SELECT 1
FROM seen
WHERE seen.id != ALL (array((SELECT other.id
FROM event AS other
WHERE other.uid = ANY (%(p0)s::UUID[]) UNION ALL SELECT tombstone.id
FROM tombstone
WHERE NOT nothing_forgotten() AND tombstone.uid = ANY (%(p0)s::UUID[])))))) ORDER BY lower(event.period), event.id
