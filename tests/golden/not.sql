SELECT event.id
FROM event
WHERE (event.agent = %(p0)s::VARCHAR) IS NOT true ORDER BY lower(event.period), event.id
