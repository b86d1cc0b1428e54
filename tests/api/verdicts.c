#include "tests/api/verdicts.h"

#include <stdio.h>
#include <stdlib.h>

#include "core/base/json_write.h"

enum { DOCUMENT_MAX = 16 * 1024 * 1024, ARENA_BYTES = 256 * 1024 * 1024 };

static void
write_error(struct json_writer *w, const struct error_item *item)
{
    json_begin_object(w, NULL);
    json_put_string(w, "code", error_code_name(item->code));
    json_put_string_or_null(w, "pointer", item->pointer);
    json_put_integer(w, "line", item->line);
    json_put_integer(w, "column", item->column);
    json_put_string(w, "detail", item->detail);
    json_end_object(w);
}

static void
write_verdict(const struct error_list *errors)
{
    struct bytes out = {0};
    struct json_writer w = {.out = &out};
    json_begin_object(&w, NULL);
    json_put_bool(&w, "ok", errors->count == 0);
    json_put_bool(&w, "truncated", errors->truncated);
    json_begin_array(&w, "errors");
    for (size_t i = 0; i < errors->count; i++)
        write_error(&w, &errors->items[i]);
    json_end_array(&w);
    json_end_object(&w);
    puts(out.failed ? "{}" : out.data);
    bytes_clear(&out);
}

int
verdicts_main(verdicts_fn read)
{
    size_t len;
    while (scanf("%zu", &len) == 1) {
        char *text =
            len <= DOCUMENT_MAX && getchar() == '\n' ? malloc(len + 1) : NULL;
        if (text == NULL || fread(text, 1, len, stdin) != len) {
            free(text);
            fputs("not a document with its length before it\n", stderr);
            return 2;
        }
        struct arena arena;
        arena_init(&arena, ARENA_BYTES);
        struct error_list errors = {.arena = &arena};
        read(text, len, &arena, &errors);
        write_verdict(&errors);
        arena_clear(&arena);
        free(text);
    }
    return feof(stdin) ? 0 : 2;
}
