SELECT event.id
FROM event
WHERE (event.feature_names = %(p0)s::TEXT[]) IS true AND hash_array(event.feature_names) = hash_array(%(p0)s::TEXT[]) ORDER BY lower(event.period), event.id
