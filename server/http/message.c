#include "server/http/message.h"

#include <stdarg.h>

void
reply_header(struct request *request, struct reply *reply, const char *name,
             const char *format, ...)
{
    if (reply->header_count == REPLY_HEADER_MAX)
        return;
    va_list args;
    va_start(args, format);
    const char *value = arena_vprintf(request->arena, format, args);
    va_end(args);
    if (value != NULL)
        reply->headers[reply->header_count++] =
            (struct reply_header){.name = name, .value = value};
}
