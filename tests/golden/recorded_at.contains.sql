SELECT event.id
FROM event
WHERE false ORDER BY lower(event.period), event.id
