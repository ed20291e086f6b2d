SELECT there.id, there.uid, there.type_id, there.period, there.frame_id, there.region AS region, there.subject_frame_id, there.subject AS subject, there.features, there.agent, there.media_type, there.payload, there.parts, array((SELECT up.whole_uid
FROM part AS up
WHERE up.part_id = there.id ORDER BY up.whole_id)) AS wholes, there.recorded_at
FROM (SELECT (SELECT standing.ctid
FROM event AS standing
WHERE standing.id = first.id) AS row, first.distance AS distance, first.id AS id
FROM (SELECT ties.distance AS distance, ties.id AS id
FROM (SELECT event.region <-> ST_GeomFromWKB(%(to)s) AS distance, event.id AS id
FROM event
WHERE true AND event.frame_id = (SELECT frame.id
FROM frame
WHERE frame.name = %(to_frame)s::VARCHAR) ORDER BY event.region <-> ST_GeomFromWKB(%(to)s)
 FETCH FIRST (%(limit)s::BIGINT) ROWS WITH TIES) AS ties ORDER BY ties.distance, ties.id
 LIMIT %(limit)s::BIGINT) AS first) AS nearest JOIN LATERAL (SELECT event.id AS id, event.uid AS uid, event.type_id AS type_id, event.period AS period, event.frame_id AS frame_id, event.region AS region, event.subject_frame_id AS subject_frame_id, event.subject AS subject, event.feature_tokens AS feature_tokens, event.feature_names AS feature_names, event.features AS features, event.agent AS agent, event.media_type AS media_type, event.payload AS payload, event.parts AS parts, event.recorded_at AS recorded_at, event.content AS content, event.feature_ends AS feature_ends
FROM event
WHERE event.ctid = nearest.row
 LIMIT ALL OFFSET 0) AS there ON true ORDER BY nearest.distance, nearest.id
