SELECT event.id
FROM event
WHERE upper(event.period) - lower(event.period) != %(p0)s ORDER BY lower(event.period), event.id
