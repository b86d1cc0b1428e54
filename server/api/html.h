/* html.h - text -> HTML, and the few marks of our help pages. Pure. */
#ifndef SERVER_API_HTML_H
#define SERVER_API_HTML_H

#include <stddef.h>

#include "core/base/bytes.h"

/* Text with & < > " ' escaped: safe in elements and quoted attributes. */
void
html_text(struct bytes *out, const char *text, size_t len);

/* Help-page marks -> HTML. Known: "# ", "## ", "### " headings (a heading that
 * is one `code` gets it as its id, with `suffix` behind it), paragraphs, "- "
 * lists, ``` blocks, `code`, **strong**, [text](target). */
void
html_marks(struct bytes *out, const char *text, size_t len, const char *suffix);

/* %XX and + decoded, from text[0 ... len) to `out` (room for len + 1). Returns
 * the length; a NUL in it stays. Broken escapes are kept as they are. */
size_t
form_decode(const char *text, size_t len, char *out);

#endif
