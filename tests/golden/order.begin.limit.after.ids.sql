WITH glance AS MATERIALIZED
(SELECT near.row AS row, near.begin AS begin, near.id AS id
FROM (SELECT event.id AS id, event.uid AS uid, event.type_id AS type_id, event.period AS period, event.frame_id AS frame_id, event.region AS region, event.subject_frame_id AS subject_frame_id, event.subject AS subject, event.feature_tokens AS feature_tokens, event.feature_names AS feature_names, event.features AS features, event.agent AS agent, event.media_type AS media_type, event.payload AS payload, event.parts AS parts, event.recorded_at AS recorded_at, event.content AS content, event.feature_ends AS feature_ends, event.ctid AS row, lower(event.period) AS begin
FROM event
WHERE lower(event.period) >= %(near_begin)s::TIMESTAMP WITH TIME ZONE AND lower(event.period) <= %(near_end)s::TIMESTAMP WITH TIME ZONE AND (lower(event.period), event.id) > (%(after_begin)s::TIMESTAMP WITH TIME ZONE, %(after_id)s::BIGINT) ORDER BY lower(event.period), event.id
 LIMIT %(glance)s::INTEGER) AS near
WHERE (near.period <@ tstzrange(%(p0)s::TIMESTAMP WITH TIME ZONE, %(p1)s::TIMESTAMP WITH TIME ZONE, '[]')) AND near.type_id IN (SELECT type_closure.descendant_id
FROM type_closure
WHERE type_closure.ancestor_id = %(p2)s::INTEGER) ORDER BY near.begin, near.id
 LIMIT %(limit)s::BIGINT),
handful AS MATERIALIZED
(SELECT event.id AS id, event.ctid AS row, lower(event.period) AS begin
FROM event
WHERE (SELECT count(*) AS count_1
FROM glance) < %(limit)s::BIGINT AND (event.period <@ tstzrange(%(p0)s::TIMESTAMP WITH TIME ZONE, %(p1)s::TIMESTAMP WITH TIME ZONE, '[]')) AND event.type_id IN (SELECT type_closure.descendant_id
FROM type_closure
WHERE type_closure.ancestor_id = %(p2)s::INTEGER) AND (lower(event.period), event.id) > (%(after_begin)s::TIMESTAMP WITH TIME ZONE, %(after_id)s::BIGINT)
 LIMIT %(handful)s::BIGINT + 1),
walk AS MATERIALIZED
(SELECT near.row AS row, near.begin AS begin, near.id AS id
FROM (SELECT event.id AS id, event.uid AS uid, event.type_id AS type_id, event.period AS period, event.frame_id AS frame_id, event.region AS region, event.subject_frame_id AS subject_frame_id, event.subject AS subject, event.feature_tokens AS feature_tokens, event.feature_names AS feature_names, event.features AS features, event.agent AS agent, event.media_type AS media_type, event.payload AS payload, event.parts AS parts, event.recorded_at AS recorded_at, event.content AS content, event.feature_ends AS feature_ends, event.ctid AS row, lower(event.period) AS begin
FROM event
WHERE lower(event.period) >= %(near_begin)s::TIMESTAMP WITH TIME ZONE AND lower(event.period) <= %(near_end)s::TIMESTAMP WITH TIME ZONE AND (lower(event.period), event.id) > (%(after_begin)s::TIMESTAMP WITH TIME ZONE, %(after_id)s::BIGINT) ORDER BY lower(event.period), event.id
 LIMIT %(walk)s::INTEGER) AS near
WHERE (SELECT count(*) AS count_2
FROM handful) > %(handful)s::BIGINT AND (near.period <@ tstzrange(%(p0)s::TIMESTAMP WITH TIME ZONE, %(p1)s::TIMESTAMP WITH TIME ZONE, '[]')) AND near.type_id IN (SELECT type_closure.descendant_id
FROM type_closure
WHERE type_closure.ancestor_id = %(p2)s::INTEGER) ORDER BY near.begin, near.id
 LIMIT %(limit)s::BIGINT),
stretch AS MATERIALIZED
(SELECT event.ctid AS row, lower(event.period) AS begin, event.id AS id
FROM event
WHERE (SELECT count(*) AS count_2
FROM handful) > %(handful)s::BIGINT AND (SELECT count(*) AS count_3
FROM walk) < %(limit)s::BIGINT AND (SELECT count(*) >= 5 AS anon_1
FROM walk) AND event.type_id = ANY (array((SELECT type_closure.descendant_id
FROM type_closure
WHERE type_closure.ancestor_id = %(p2)s::INTEGER))) AND lower(event.period) >= (SELECT CASE WHEN (count(*) >= 5) THEN min(walk.begin) END AS anon_2
FROM walk) AND lower(event.period) <= (SELECT CASE WHEN (count(*) >= 5) THEN to_timestamp(least(EXTRACT(epoch FROM min(walk.begin)) + (EXTRACT(epoch FROM max(walk.begin) - min(walk.begin)) / CAST((count(*) - 1) AS NUMERIC)) * %(limit)s::BIGINT * 1.5, 1e11)) END AS anon_3
FROM walk) AND (event.period <@ tstzrange(%(p0)s::TIMESTAMP WITH TIME ZONE, %(p1)s::TIMESTAMP WITH TIME ZONE, '[]')) AND event.type_id IN (SELECT type_closure.descendant_id
FROM type_closure
WHERE type_closure.ancestor_id = %(p2)s::INTEGER) AND (lower(event.period), event.id) > (%(after_begin)s::TIMESTAMP WITH TIME ZONE, %(after_id)s::BIGINT))
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
FROM stretch) >= %(limit)s::BIGINT UNION ALL SELECT event.ctid AS row, lower(event.period) AS begin, event.id AS id
FROM event
WHERE (SELECT count(*) AS count_2
FROM handful) > %(handful)s::BIGINT AND (SELECT count(*) AS count_3
FROM walk) < %(limit)s::BIGINT AND (SELECT count(*) AS count_4
FROM stretch) < %(limit)s::BIGINT AND (event.period <@ tstzrange(%(p0)s::TIMESTAMP WITH TIME ZONE, %(p1)s::TIMESTAMP WITH TIME ZONE, '[]')) AND event.type_id IN (SELECT type_closure.descendant_id
FROM type_closure
WHERE type_closure.ancestor_id = %(p2)s::INTEGER) AND (lower(event.period), event.id) > (%(after_begin)s::TIMESTAMP WITH TIME ZONE, %(after_id)s::BIGINT)) AS found ORDER BY found.begin, found.id
 LIMIT %(limit)s::BIGINT) AS ids ORDER BY ids.begin, ids.id
