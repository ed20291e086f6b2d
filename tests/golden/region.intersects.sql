SELECT event.id
FROM event
WHERE event.frame_id = %(p0)s::INTEGER AND ST_Intersects(event.region, ST_GeomFromWKB(%(p1)s)) ORDER BY lower(event.period), event.id
