SELECT event.id
FROM event
WHERE event.agent = %(p0)s::VARCHAR ORDER BY lower(event.period), event.id
