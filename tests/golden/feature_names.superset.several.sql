SELECT event.id
FROM event
WHERE (event.feature_names @> %(p0)s::TEXT[]) AND (hash_array(event.feature_names) + (CAST(cardinality(event.feature_names) AS BIGINT) << 32) > %(p1)s::BIGINT OR hash_array(event.feature_names) + (CAST(cardinality(event.feature_names) AS BIGINT) << 32) = hash_array(%(p0)s::TEXT[]) + (CAST(cardinality(%(p0)s::TEXT[]) AS BIGINT) << 32)) ORDER BY lower(event.period), event.id
