SELECT event.id
FROM event
WHERE event.id IN (SELECT reached.own_id
FROM (SELECT part.part_id AS own_id, part.whole_id AS start_id
FROM part
WHERE part.whole_id IN (SELECT other.id
FROM event AS other
WHERE other.uid = ANY (%(p0)s::UUID[]))) AS reached GROUP BY reached.own_id
HAVING count(DISTINCT reached.start_id) = cardinality(%(p0)s::UUID[])) AND NOT (EXISTS (SELECT 1
FROM part AS link
WHERE link.part_id = event.id AND link.whole_uid != ALL (%(p0)s::UUID[]))) ORDER BY lower(event.period), event.id
