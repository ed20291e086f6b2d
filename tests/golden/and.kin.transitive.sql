SELECT event.id
FROM event
WHERE event.id IN (WITH RECURSIVE reached(own_id, start_id) AS
(SELECT part.whole_id AS own_id, part.part_id AS start_id
FROM part
WHERE part.part_id IN (SELECT other.id
FROM event AS other
WHERE other.uid = ANY (%(p0)s::UUID[]) UNION ALL SELECT tombstone.id
FROM tombstone
WHERE NOT nothing_forgotten() AND tombstone.uid = ANY (%(p0)s::UUID[])) UNION SELECT step.whole_id AS whole_id, reached.start_id AS start_id
FROM part AS step JOIN reached ON step.part_id = reached.own_id)
 SELECT reached.own_id
FROM reached GROUP BY reached.own_id
HAVING count(DISTINCT reached.start_id) = cardinality(%(p0)s::UUID[])) AND NOT (EXISTS (WITH RECURSIVE seen(id) AS
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
WHERE NOT nothing_forgotten() AND tombstone.uid = ANY (%(p0)s::UUID[])))))) AND (NOT (EXISTS (WITH RECURSIVE seen(id) AS
(SELECT part.whole_id AS id
FROM part
WHERE part.part_id = event.id UNION SELECT step.whole_id AS whole_id
FROM part AS step JOIN seen ON step.part_id = seen.id)
 SELECT 1
FROM seen
WHERE seen.id != ALL (array((SELECT other.id
FROM event AS other
WHERE other.uid = ANY (%(p1)s::UUID[]))))))) IS NOT true ORDER BY lower(event.period), event.id
