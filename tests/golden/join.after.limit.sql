WITH close AS MATERIALIZED
(SELECT walk.id AS id, walk.period AS period
FROM (SELECT event.id AS id, event.uid AS uid, event.type_id AS type_id, event.period AS period, event.frame_id AS frame_id, event.region AS region, event.subject_frame_id AS subject_frame_id, event.subject AS subject, event.feature_tokens AS feature_tokens, event.feature_names AS feature_names, event.features AS features, event.agent AS agent, event.media_type AS media_type, event.payload AS payload, event.parts AS parts, event.recorded_at AS recorded_at, event.content AS content, event.feature_ends AS feature_ends
FROM event
WHERE lower(event.period) >= %(near_begin)s::TIMESTAMP WITH TIME ZONE AND lower(event.period) <= %(near_end)s::TIMESTAMP WITH TIME ZONE ORDER BY lower(event.period), event.id
 LIMIT %(walk)s::INTEGER) AS walk
WHERE (walk.period <@ tstzrange(%(p0)s::TIMESTAMP WITH TIME ZONE, %(p1)s::TIMESTAMP WITH TIME ZONE, '[]')) AND walk.type_id IN (SELECT type_closure.descendant_id
FROM type_closure
WHERE type_closure.ancestor_id = %(p2)s::INTEGER) ORDER BY lower(walk.period), walk.id
 LIMIT %(limit)s::BIGINT),
candidates AS MATERIALIZED
(SELECT event.id AS id, event.period AS period
FROM event
WHERE (SELECT count(*) AS count_1
FROM close) < %(limit)s::BIGINT AND (event.period <@ tstzrange(%(p0)s::TIMESTAMP WITH TIME ZONE, %(p1)s::TIMESTAMP WITH TIME ZONE, '[]')) AND event.type_id IN (SELECT type_closure.descendant_id
FROM type_closure
WHERE type_closure.ancestor_id = %(p2)s::INTEGER))
 SELECT a.id, nearest.id AS id_1
FROM (SELECT event.id AS id
FROM event JOIN (SELECT close.id AS id, close.period AS period
FROM close
WHERE (SELECT count(*) AS count_1
FROM close) >= %(limit)s::BIGINT UNION ALL SELECT sorted.id AS id, sorted.period AS period
FROM (SELECT candidates.id AS id, candidates.period AS period
FROM candidates ORDER BY lower(candidates.period), candidates.id
 LIMIT %(limit)s::BIGINT) AS sorted) AS ids ON ids.id = event.id ORDER BY lower(event.period), event.id) AS anchor JOIN event AS a ON a.id = anchor.id LEFT OUTER JOIN LATERAL (SELECT n.id AS id
FROM event AS n
WHERE n.agent = %(n0)s::VARCHAR AND lower(n.period) > upper(a.period) ORDER BY lower(n.period), n.id
 LIMIT 1) AS nearest ON true ORDER BY lower(a.period), a.id
