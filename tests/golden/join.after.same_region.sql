SELECT a.id, nearest.id AS id_1
FROM (SELECT event.id AS id
FROM event
WHERE (event.period <@ tstzrange(%(p0)s::TIMESTAMP WITH TIME ZONE, %(p1)s::TIMESTAMP WITH TIME ZONE, '[]')) AND event.type_id IN (SELECT type_closure.descendant_id
FROM type_closure
WHERE type_closure.ancestor_id = %(p2)s::INTEGER) ORDER BY lower(event.period), event.id) AS anchor JOIN event AS a ON a.id = anchor.id LEFT OUTER JOIN LATERAL (SELECT n.id AS id
FROM event AS n
WHERE n.agent = %(n0)s::VARCHAR AND lower(n.period) > upper(a.period) AND n.frame_id = a.frame_id AND ST_Intersects(n.region, a.region) ORDER BY lower(n.period), n.id
 LIMIT 1) AS nearest ON true ORDER BY lower(a.period), a.id
