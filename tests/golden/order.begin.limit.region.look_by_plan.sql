WITH many0 AS MATERIALIZED
(SELECT event.ctid AS row, lower(event.period) AS begin, event.id AS id
FROM event
WHERE event.frame_id = %(p0)s::INTEGER AND ST_Intersects(event.region, ST_GeomFromWKB(%(p1)s)) OR event.frame_id = %(p2)s::INTEGER AND ST_Touches(event.region, ST_GeomFromWKB(%(p3)s))
 LIMIT %(many)s::BIGINT + 1)
 SELECT rows.id, answer.seen
FROM (SELECT CASE WHEN ((SELECT count(*) AS count_1
FROM many0) > %(many)s::BIGINT) THEN 0 END AS seen) AS answer LEFT OUTER JOIN (SELECT there.id AS id, there.uid AS uid, there.type_id AS type_id, there.period AS period, there.frame_id AS frame_id, there.region AS region, there.subject_frame_id AS subject_frame_id, there.subject AS subject, there.feature_tokens AS feature_tokens, there.feature_names AS feature_names, there.features AS features, there.agent AS agent, there.media_type AS media_type, there.payload AS payload, there.parts AS parts, there.recorded_at AS recorded_at, there.content AS content, there.feature_ends AS feature_ends, ordered.begin AS begin
FROM (SELECT places.row AS row, places.begin AS begin, places.id AS id, places.judged AS judged
FROM (SELECT many0.row AS row, many0.begin AS begin, many0.id AS id, false AS judged
FROM many0
WHERE (SELECT count(*) AS count_1
FROM many0) <= %(many)s::BIGINT) AS places ORDER BY places.begin, places.id
 LIMIT ALL OFFSET 0) AS ordered JOIN LATERAL (SELECT event.id AS id, event.uid AS uid, event.type_id AS type_id, event.period AS period, event.frame_id AS frame_id, event.region AS region, event.subject_frame_id AS subject_frame_id, event.subject AS subject, event.feature_tokens AS feature_tokens, event.feature_names AS feature_names, event.features AS features, event.agent AS agent, event.media_type AS media_type, event.payload AS payload, event.parts AS parts, event.recorded_at AS recorded_at, event.content AS content, event.feature_ends AS feature_ends
FROM event
WHERE event.ctid = ordered.row AND (ordered.judged OR event.frame_id = %(p0)s::INTEGER AND ST_Intersects(event.region, ST_GeomFromWKB(%(p1)s)) OR event.frame_id = %(p2)s::INTEGER AND ST_Touches(event.region, ST_GeomFromWKB(%(p3)s)))
 LIMIT ALL OFFSET 0) AS there ON true ORDER BY ordered.begin, ordered.id
 LIMIT %(limit)s::BIGINT) AS rows ON true ORDER BY rows.begin, rows.id
