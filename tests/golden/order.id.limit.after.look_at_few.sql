WITH peek AS MATERIALIZED
(SELECT near.row AS row, near.begin AS begin, near.id AS id
FROM (SELECT event.id AS id, event.uid AS uid, event.type_id AS type_id, event.period AS period, event.frame_id AS frame_id, event.region AS region, event.subject_frame_id AS subject_frame_id, event.subject AS subject, event.feature_tokens AS feature_tokens, event.feature_names AS feature_names, event.features AS features, event.agent AS agent, event.media_type AS media_type, event.payload AS payload, event.parts AS parts, event.recorded_at AS recorded_at, event.content AS content, event.feature_ends AS feature_ends, event.ctid AS row, lower(event.period) AS begin
FROM event
WHERE event.id > %(after_id)s::BIGINT ORDER BY event.id
 LIMIT %(peek)s::INTEGER) AS near
WHERE (near.period <@ tstzrange(%(p0)s::TIMESTAMP WITH TIME ZONE, %(p1)s::TIMESTAMP WITH TIME ZONE, '[]')) AND (SELECT type_closure.descendant_id
FROM type_closure
WHERE type_closure.ancestor_id = %(p2)s::INTEGER AND type_closure.descendant_id = near.type_id) IS NOT NULL ORDER BY near.id
 LIMIT %(limit)s::BIGINT),
few0 AS MATERIALIZED
(SELECT event.ctid AS row, lower(event.period) AS begin, event.id AS id
FROM event
WHERE (SELECT count(*) AS count_1
FROM peek) < %(limit)s::BIGINT AND (event.period <@ tstzrange(%(p0)s::TIMESTAMP WITH TIME ZONE, %(p1)s::TIMESTAMP WITH TIME ZONE, '[]'))
 LIMIT %(few)s::BIGINT + 1)
 SELECT rows.id, answer.seen
FROM (SELECT CASE WHEN (NOT ((SELECT count(*) AS count_1
FROM peek) >= %(limit)s::BIGINT OR (SELECT count(*) AS count_2
FROM few0) <= %(few)s::BIGINT)) THEN 0 END AS seen) AS answer LEFT OUTER JOIN (SELECT there.id AS id, there.uid AS uid, there.type_id AS type_id, there.period AS period, there.frame_id AS frame_id, there.region AS region, there.subject_frame_id AS subject_frame_id, there.subject AS subject, there.feature_tokens AS feature_tokens, there.feature_names AS feature_names, there.features AS features, there.agent AS agent, there.media_type AS media_type, there.payload AS payload, there.parts AS parts, there.recorded_at AS recorded_at, there.content AS content, there.feature_ends AS feature_ends, ordered.begin AS begin
FROM (SELECT places.row AS row, places.begin AS begin, places.id AS id, places.judged AS judged
FROM (SELECT peek.row AS row, peek.begin AS begin, peek.id AS id, true AS judged
FROM peek
WHERE (SELECT count(*) AS count_1
FROM peek) >= %(limit)s::BIGINT UNION ALL SELECT few0.row AS row, few0.begin AS begin, few0.id AS id, false AS judged
FROM few0
WHERE (SELECT count(*) AS count_2
FROM few0) <= %(few)s::BIGINT) AS places ORDER BY places.id
 LIMIT ALL OFFSET 0) AS ordered JOIN LATERAL (SELECT event.id AS id, event.uid AS uid, event.type_id AS type_id, event.period AS period, event.frame_id AS frame_id, event.region AS region, event.subject_frame_id AS subject_frame_id, event.subject AS subject, event.feature_tokens AS feature_tokens, event.feature_names AS feature_names, event.features AS features, event.agent AS agent, event.media_type AS media_type, event.payload AS payload, event.parts AS parts, event.recorded_at AS recorded_at, event.content AS content, event.feature_ends AS feature_ends
FROM event
WHERE event.ctid = ordered.row AND (ordered.judged OR (event.period <@ tstzrange(%(p0)s::TIMESTAMP WITH TIME ZONE, %(p1)s::TIMESTAMP WITH TIME ZONE, '[]')) AND (SELECT type_closure.descendant_id
FROM type_closure
WHERE type_closure.ancestor_id = %(p2)s::INTEGER AND type_closure.descendant_id = event.type_id) IS NOT NULL AND event.id > %(after_id)s::BIGINT)
 LIMIT ALL OFFSET 0) AS there ON true ORDER BY ordered.id
 LIMIT %(limit)s::BIGINT) AS rows ON true ORDER BY rows.id
