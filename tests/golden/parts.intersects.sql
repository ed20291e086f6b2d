SELECT event.id
FROM event
WHERE event.id IN (SELECT reached.own_id
FROM (SELECT part.whole_id AS own_id, part.part_id AS start_id
FROM part
WHERE part.part_id IN (SELECT other.id
FROM event AS other
WHERE other.uid = ANY (%(p0)s::UUID[]) UNION ALL SELECT tombstone.id
FROM tombstone
WHERE NOT nothing_forgotten() AND tombstone.uid = ANY (%(p0)s::UUID[]))) AS reached) ORDER BY lower(event.period), event.id
