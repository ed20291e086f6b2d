SELECT event.id
FROM event
WHERE event.subject_frame_id = %(p0)s::INTEGER AND ST_Covers(event.subject, ST_GeomFromWKB(%(p1)s)) ORDER BY lower(event.period), event.id
