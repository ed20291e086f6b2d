SELECT event.id
FROM event
WHERE (event.feature_names <@ %(p0)s::TEXT[]) IS true AND hash_array(event.feature_names) = ANY (ARRAY[hash_array(%(p1)s::TEXT[]), hash_array(%(p2)s::TEXT[])]) ORDER BY lower(event.period), event.id
