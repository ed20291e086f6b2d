SELECT event.id
FROM event
WHERE event.feature_tokens = %(p0)s::TEXT[] ORDER BY lower(event.period), event.id
