SELECT event.id
FROM event
WHERE (event.type_id = %(p0)s::INTEGER AND (event.agent = %(p1)s::VARCHAR OR (event.agent = %(p2)s::VARCHAR) IS NOT true)) IS NOT true ORDER BY lower(event.period), event.id
