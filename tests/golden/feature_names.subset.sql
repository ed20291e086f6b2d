SELECT event.id
FROM event
WHERE (event.feature_names <@ %(p0)s::TEXT[]) IS true AND hash_array(event.feature_names) + (CAST(cardinality(event.feature_names) AS BIGINT) << 32) = ANY (ARRAY[hash_array(%(p1)s::TEXT[]) + 0, hash_array(%(p2)s::TEXT[]) + 4294967296]) ORDER BY lower(event.period), event.id
