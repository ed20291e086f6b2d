SELECT event.id, event.uid, event.type_id, event.period, event.frame_id, event.region AS region, event.subject_frame_id, event.subject AS subject, event.features, event.agent, event.media_type, event.payload, event.parts, array((SELECT up.whole_uid
FROM part AS up
WHERE up.part_id = event.id ORDER BY up.whole_id)) AS wholes, event.recorded_at
FROM event
WHERE (event.period <@ tstzrange(%(p0)s::TIMESTAMP WITH TIME ZONE, %(p1)s::TIMESTAMP WITH TIME ZONE, '[]')) AND event.type_id IN (SELECT type_closure.descendant_id
FROM type_closure
WHERE type_closure.ancestor_id = %(p2)s::INTEGER) AND event.frame_id = (SELECT frame.id
FROM frame
WHERE frame.name = %(to_frame)s::VARCHAR) ORDER BY event.region <-> ST_GeomFromWKB(%(to)s), event.id
 LIMIT %(limit)s::BIGINT
