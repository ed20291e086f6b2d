WITH walk AS MATERIALIZED
(SELECT near.row AS row, near.begin AS begin, near.id AS id
FROM (SELECT event.id AS id, event.uid AS uid, event.type_id AS type_id, event.period AS period, event.frame_id AS frame_id, event.region AS region, event.subject_frame_id AS subject_frame_id, event.subject AS subject, event.feature_tokens AS feature_tokens, event.feature_names AS feature_names, event.features AS features, event.agent AS agent, event.media_type AS media_type, event.payload AS payload, event.parts AS parts, event.recorded_at AS recorded_at, event.content AS content, event.feature_ends AS feature_ends, event.ctid AS row, lower(event.period) AS begin
FROM event ORDER BY lower(event.period), event.id
 LIMIT %(walk)s::INTEGER) AS near
WHERE NOT (EXISTS (WITH RECURSIVE seen(id) AS
(SELECT part.part_id AS id
FROM part
WHERE part.whole_id = near.id UNION SELECT step.part_id AS part_id
FROM part AS step JOIN seen ON step.whole_id = seen.id)
 SELECT 1
FROM seen
WHERE seen.id != ALL (array((SELECT other.id
FROM event AS other
WHERE other.uid = ANY (%(p0)s::UUID[]) UNION ALL SELECT tombstone.id
FROM tombstone
WHERE NOT nothing_forgotten() AND tombstone.uid = ANY (%(p0)s::UUID[])))))) ORDER BY near.begin, near.id
 LIMIT %(limit)s::BIGINT)
 SELECT ids.id
FROM (SELECT found.row AS row, found.begin AS begin, found.id AS id
FROM (SELECT walk.row AS row, walk.begin AS begin, walk.id AS id
FROM walk
WHERE (SELECT count(*) AS count_1
FROM walk) >= %(limit)s::BIGINT UNION ALL SELECT event.ctid AS row, lower(event.period) AS begin, event.id AS id
FROM event
WHERE (SELECT count(*) AS count_1
FROM walk) < %(limit)s::BIGINT AND NOT (EXISTS (WITH RECURSIVE seen(id) AS
(SELECT part.part_id AS id
FROM part
WHERE part.whole_id = event.id UNION SELECT step.part_id AS part_id
FROM part AS step JOIN seen ON step.whole_id = seen.id)
 SELECT 1
FROM seen
WHERE seen.id != ALL (array((SELECT other.id
FROM event AS other
WHERE other.uid = ANY (%(p0)s::UUID[]) UNION ALL SELECT tombstone.id
FROM tombstone
WHERE NOT nothing_forgotten() AND tombstone.uid = ANY (%(p0)s::UUID[]))))))) AS found ORDER BY found.begin, found.id
 LIMIT %(limit)s::BIGINT) AS ids ORDER BY ids.begin, ids.id
