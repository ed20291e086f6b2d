SELECT event.id
FROM event
WHERE event.subject_frame_id = %(p0)s::INTEGER AND ST_DWithin(event.subject, ST_GeomFromWKB(%(p1)s), %(p2)s) ORDER BY lower(event.period), event.id
