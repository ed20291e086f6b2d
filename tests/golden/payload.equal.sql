SELECT event.id
FROM event
WHERE sha256(event.payload) = sha256(%(p0)s) AND event.payload = %(p0)s ORDER BY lower(event.period), event.id
