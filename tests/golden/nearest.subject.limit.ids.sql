SELECT event.id
FROM event
WHERE (event.period <@ tstzrange(%(p0)s::TIMESTAMP WITH TIME ZONE, %(p1)s::TIMESTAMP WITH TIME ZONE, '[]')) AND event.type_id IN (SELECT type_closure.descendant_id
FROM type_closure
WHERE type_closure.ancestor_id = %(p2)s::INTEGER) AND event.subject_frame_id = (SELECT frame.id
FROM frame
WHERE frame.name = %(to_frame)s::VARCHAR) ORDER BY event.subject <-> ST_GeomFromWKB(%(to)s), event.id
 LIMIT %(limit)s::BIGINT
