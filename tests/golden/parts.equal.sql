SELECT event.id
FROM event
WHERE event.id = ANY (array((SELECT part.whole_id
FROM part JOIN (SELECT other.id AS id
FROM event AS other
WHERE other.uid = %(p1)s::UUID UNION ALL SELECT tombstone.id AS id
FROM tombstone
WHERE NOT nothing_forgotten() AND tombstone.uid = %(p1)s::UUID) AS named ON named.id = part.part_id))) AND (event.parts @> %(p0)s::UUID[]) AND (event.parts <@ %(p0)s::UUID[]) ORDER BY lower(event.period), event.id
