WITH glance AS MATERIALIZED
(SELECT near.row AS row, near.begin AS begin, near.id AS id
FROM (SELECT event.id AS id, event.uid AS uid, event.type_id AS type_id, event.period AS period, event.frame_id AS frame_id, event.region AS region, event.subject_frame_id AS subject_frame_id, event.subject AS subject, event.feature_tokens AS feature_tokens, event.feature_names AS feature_names, event.features AS features, event.agent AS agent, event.media_type AS media_type, event.payload AS payload, event.parts AS parts, event.recorded_at AS recorded_at, event.content AS content, event.feature_ends AS feature_ends, event.ctid AS row, lower(event.period) AS begin
FROM event ORDER BY lower(event.period), event.id
 LIMIT %(glance)s::INTEGER) AS near
WHERE ((near.region && ST_GeomFromWKB(%(p1)s)) OR (near.region && ST_GeomFromWKB(%(p3)s))) AND (near.frame_id = %(p0)s::INTEGER AND ST_Intersects(near.region, ST_GeomFromWKB(%(p1)s)) OR near.frame_id = %(p2)s::INTEGER AND ST_Touches(near.region, ST_GeomFromWKB(%(p3)s))) ORDER BY near.begin, near.id
 LIMIT %(limit)s::BIGINT),
handful AS MATERIALIZED
(SELECT event.id AS id, event.ctid AS row, lower(event.period) AS begin
FROM event
WHERE (SELECT count(*) AS count_1
FROM glance) < %(limit)s::BIGINT AND (event.frame_id = %(p0)s::INTEGER AND ST_Intersects(event.region, ST_GeomFromWKB(%(p1)s)) OR event.frame_id = %(p2)s::INTEGER AND ST_Touches(event.region, ST_GeomFromWKB(%(p3)s)))
 LIMIT %(handful)s::BIGINT + 1),
walk AS MATERIALIZED
(SELECT near.row AS row, near.begin AS begin, near.id AS id
FROM (SELECT event.id AS id, event.uid AS uid, event.type_id AS type_id, event.period AS period, event.frame_id AS frame_id, event.region AS region, event.subject_frame_id AS subject_frame_id, event.subject AS subject, event.feature_tokens AS feature_tokens, event.feature_names AS feature_names, event.features AS features, event.agent AS agent, event.media_type AS media_type, event.payload AS payload, event.parts AS parts, event.recorded_at AS recorded_at, event.content AS content, event.feature_ends AS feature_ends, event.ctid AS row, lower(event.period) AS begin
FROM event ORDER BY lower(event.period), event.id
 LIMIT %(walk)s::INTEGER) AS near
WHERE (SELECT count(*) AS count_2
FROM handful) > %(handful)s::BIGINT AND ((near.region && ST_GeomFromWKB(%(p1)s)) OR (near.region && ST_GeomFromWKB(%(p3)s))) AND (near.frame_id = %(p0)s::INTEGER AND ST_Intersects(near.region, ST_GeomFromWKB(%(p1)s)) OR near.frame_id = %(p2)s::INTEGER AND ST_Touches(near.region, ST_GeomFromWKB(%(p3)s))) ORDER BY near.begin, near.id
 LIMIT %(limit)s::BIGINT),
stretch AS MATERIALIZED
(SELECT event.ctid AS row, lower(event.period) AS begin, event.id AS id
FROM event
WHERE (SELECT count(*) AS count_2
FROM handful) > %(handful)s::BIGINT AND (SELECT count(*) AS count_3
FROM walk) < %(limit)s::BIGINT AND (SELECT count(*) >= 5 AND count(*) * count(*) * (SELECT reltuples FROM pg_class WHERE oid = 'event'::regclass) > %(walk)s::INTEGER * %(walk)s::INTEGER * %(limit)s::BIGINT * 0.05 AS anon_1
FROM walk) AND lower(event.period) >= (SELECT CASE WHEN (count(*) >= 5) THEN min(walk.begin) END AS anon_2
FROM walk) AND lower(event.period) <= (SELECT CASE WHEN (count(*) >= 5) THEN to_timestamp(least(EXTRACT(epoch FROM min(walk.begin)) + (EXTRACT(epoch FROM max(walk.begin) - min(walk.begin)) / CAST((count(*) - 1) AS NUMERIC)) * %(limit)s::BIGINT * 1.5, 1e11)) END AS anon_3
FROM walk) AND (event.frame_id = %(p0)s::INTEGER AND ST_Intersects(event.region, ST_GeomFromWKB(%(p1)s)) OR event.frame_id = %(p2)s::INTEGER AND ST_Touches(event.region, ST_GeomFromWKB(%(p3)s)))),
candidates AS MATERIALIZED
(SELECT event.ctid AS row, lower(event.period) AS begin, event.id AS id
FROM event
WHERE (SELECT count(*) AS count_2
FROM handful) > %(handful)s::BIGINT AND (SELECT count(*) AS count_3
FROM walk) < %(limit)s::BIGINT AND (SELECT count(*) AS count_4
FROM stretch) < %(limit)s::BIGINT AND (event.frame_id = %(p0)s::INTEGER AND (event.region && ST_GeomFromWKB(%(p1)s)) OR event.frame_id = %(p2)s::INTEGER AND (event.region && ST_GeomFromWKB(%(p3)s))))
 SELECT ids.id
FROM (SELECT found.row AS row, found.begin AS begin, found.id AS id
FROM (SELECT glance.row AS row, glance.begin AS begin, glance.id AS id
FROM glance
WHERE (SELECT count(*) AS count_1
FROM glance) >= %(limit)s::BIGINT UNION ALL SELECT handful.row AS row, handful.begin AS begin, handful.id AS id
FROM handful
WHERE (SELECT count(*) AS count_2
FROM handful) <= %(handful)s::BIGINT UNION ALL SELECT walk.row AS row, walk.begin AS begin, walk.id AS id
FROM walk
WHERE (SELECT count(*) AS count_3
FROM walk) >= %(limit)s::BIGINT UNION ALL SELECT stretch.row AS row, stretch.begin AS begin, stretch.id AS id
FROM stretch
WHERE (SELECT count(*) AS count_4
FROM stretch) >= %(limit)s::BIGINT UNION ALL SELECT judged.row AS row, judged.begin AS begin, judged.id AS id
FROM (SELECT ordered.row AS row, ordered.begin AS begin, ordered.id AS id
FROM (SELECT candidates.row AS row, candidates.begin AS begin, candidates.id AS id
FROM candidates ORDER BY candidates.begin, candidates.id
 LIMIT ALL OFFSET 0) AS ordered JOIN LATERAL (SELECT event.id AS id, event.uid AS uid, event.type_id AS type_id, event.period AS period, event.frame_id AS frame_id, event.region AS region, event.subject_frame_id AS subject_frame_id, event.subject AS subject, event.feature_tokens AS feature_tokens, event.feature_names AS feature_names, event.features AS features, event.agent AS agent, event.media_type AS media_type, event.payload AS payload, event.parts AS parts, event.recorded_at AS recorded_at, event.content AS content, event.feature_ends AS feature_ends
FROM event
WHERE event.ctid = ordered.row AND (event.frame_id = %(p0)s::INTEGER AND ST_Intersects(event.region, ST_GeomFromWKB(%(p1)s)) OR event.frame_id = %(p2)s::INTEGER AND ST_Touches(event.region, ST_GeomFromWKB(%(p3)s)))
 LIMIT ALL OFFSET 0) AS there ON true ORDER BY ordered.begin, ordered.id
 LIMIT %(limit)s::BIGINT) AS judged) AS found ORDER BY found.begin, found.id
 LIMIT %(limit)s::BIGINT) AS ids ORDER BY ids.begin, ids.id
