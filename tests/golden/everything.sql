SELECT event.id
FROM event
WHERE true ORDER BY lower(event.period), event.id
