/* prefer.h - the header fields by which a client chooses: Prefer (RFC 7240),
 * Accept and If-None-Match (RFC 9110). What cannot be read is ignored, as the
 * standards ask. Pure; any thread; header values may be NULL. */
#ifndef SERVER_API_PREFER_H
#define SERVER_API_PREFER_H

#include <stdbool.h>
#include <stddef.h>

struct prefer {
    bool respond_async;
    bool has_wait;
    double wait; /* seconds, >= 0; as sent, not cut */
};

/* The first of two equal preferences counts. */
struct prefer
prefer_read(const char *header);

/* Index of the type the client likes best among `types` ("image/png"), the
 * earlier one if it likes two alike; -1 if it accepts none. NULL or an empty
 * header accepts everything. */
int
accept_choose(const char *header, const char *const *types, size_t count);

/* Index of the language ("de") the reader likes best, as accept_choose; 0 if
 * none of them is named. "de-AT" is "de". */
size_t
language_choose(const char *header, const char *const *codes, size_t count);

/* Is the entity tag (with its quotes) in the list, by weak comparison? "*"
 * matches everything. */
bool
etag_listed(const char *header, const char *etag);

/* Does the comma-separated header contain this word, in any case? */
bool
header_has_word(const char *header, const char *word);

/* A whole number of seconds, 0...1e9, and nothing else. */
bool
seconds_read(const char *text, double *seconds);

#endif
