WITH found AS MATERIALIZED
(SELECT event.ctid AS row, lower(event.period) AS begin, event.id AS id
FROM event
WHERE upper(event.period) - lower(event.period) <= %(p0)s)
 SELECT sorted.id
FROM (SELECT found.row AS row, found.begin AS begin, found.id AS id
FROM found ORDER BY found.begin, found.id
 LIMIT ALL OFFSET 0) AS sorted ORDER BY sorted.begin, sorted.id
