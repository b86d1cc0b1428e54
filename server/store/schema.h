/* schema.h - the SQL of sql/, embedded at build time (embed_sql.cmake).
 *
 * Forward only: step n (schema_steps[n - 1]) takes a database from
 * user_version n - 1 to n, in one transaction. */
#ifndef SERVER_STORE_SCHEMA_H
#define SERVER_STORE_SCHEMA_H

extern const char *const schema_steps[];
extern const int schema_version; /* the newest, = number of steps */

#endif
