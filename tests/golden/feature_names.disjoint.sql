SELECT event.id
FROM event
WHERE NOT (event.feature_names && %(p0)s::TEXT[]) ORDER BY lower(event.period), event.id
