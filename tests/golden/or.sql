SELECT event.id
FROM event
WHERE event.type_id = %(p0)s::INTEGER OR event.agent = %(p1)s::VARCHAR ORDER BY lower(event.period), event.id
