SELECT event.id
FROM event
WHERE (event.id NOT IN (WITH RECURSIVE reached(own_id, start_id) AS
(SELECT part.part_id AS own_id, part.whole_id AS start_id
FROM part
WHERE part.whole_id IN (SELECT other.id
FROM event AS other
WHERE other.uid = ANY (%(p0)s::UUID[])) UNION SELECT step.part_id AS part_id, reached.start_id AS start_id
FROM part AS step JOIN reached ON step.whole_id = reached.own_id)
 SELECT reached.own_id
FROM reached)) ORDER BY lower(event.period), event.id
