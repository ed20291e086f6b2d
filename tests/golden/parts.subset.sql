SELECT event.id
FROM event
WHERE event.parts <@ %(p0)s::UUID[] ORDER BY lower(event.period), event.id
