SELECT nearest.id
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
 LIMIT %(limit)s::BIGINT) AS first) AS nearest ORDER BY nearest.distance, nearest.id
