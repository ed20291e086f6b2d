WITH close AS MATERIALIZED
(SELECT walk.id AS id, walk.period AS period
FROM (SELECT event.id AS id, event.uid AS uid, event.type_id AS type_id, event.period AS period, event.frame_id AS frame_id, event.region AS region, event.subject_frame_id AS subject_frame_id, event.subject AS subject, event.feature_tokens AS feature_tokens, event.feature_names AS feature_names, event.features AS features, event.agent AS agent, event.media_type AS media_type, event.payload AS payload, event.parts AS parts, event.recorded_at AS recorded_at, event.content AS content, event.feature_ends AS feature_ends
FROM event
WHERE event.id > %(after_id)s::BIGINT ORDER BY event.id
 LIMIT %(walk)s::INTEGER) AS walk
WHERE (walk.period <@ tstzrange(%(p0)s::TIMESTAMP WITH TIME ZONE, %(p1)s::TIMESTAMP WITH TIME ZONE, '[]')) AND walk.type_id IN (SELECT type_closure.descendant_id
FROM type_closure
WHERE type_closure.ancestor_id = %(p2)s::INTEGER) ORDER BY walk.id
 LIMIT %(limit)s::BIGINT),
candidates AS MATERIALIZED
(SELECT event.id AS id, event.period AS period
FROM event
WHERE (SELECT count(*) AS count_1
FROM close) < %(limit)s::BIGINT AND (event.period <@ tstzrange(%(p0)s::TIMESTAMP WITH TIME ZONE, %(p1)s::TIMESTAMP WITH TIME ZONE, '[]')) AND event.type_id IN (SELECT type_closure.descendant_id
FROM type_closure
WHERE type_closure.ancestor_id = %(p2)s::INTEGER) AND event.id > %(after_id)s::BIGINT)
 SELECT event.id
FROM event JOIN (SELECT close.id AS id, close.period AS period
FROM close
WHERE (SELECT count(*) AS count_1
FROM close) >= %(limit)s::BIGINT UNION ALL SELECT sorted.id AS id, sorted.period AS period
FROM (SELECT candidates.id AS id, candidates.period AS period
FROM candidates ORDER BY candidates.id
 LIMIT %(limit)s::BIGINT) AS sorted) AS ids ON ids.id = event.id ORDER BY event.id
