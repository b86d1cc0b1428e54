#include "core/base/error.h"

#include <stdio.h>
#include <string.h>

#include "core/base/arena.h"

static const char *const code_names[ERROR_CODE_COUNT] = {
#define X(code, name) [code] = name,
    ERROR_TABLE(X)
#undef X
};

const char *
error_code_name(enum error_code code)
{
    if ((unsigned)code >= ERROR_CODE_COUNT)
        return "internal";
    return code_names[code];
}

enum error_code
error_code_find(const char *name)
{
    for (unsigned i = 0; i < ERROR_CODE_COUNT; i++) {
        if (strcmp(code_names[i], name) == 0)
            return (enum error_code)i;
    }
    return ERROR_INTERNAL;
}

bool
error_set(struct error *err, enum error_code code, const char *format, ...)
{
    if (err == NULL || err->code != ERROR_NONE)
        return false;
    va_list args;
    va_start(args, format);
    vsnprintf(err->text, sizeof err->text, format, args);
    va_end(args);
    err->code = code;
    return false;
}

bool
error_errno(struct error *err, enum error_code code, int errno_value,
            const char *format, ...)
{
    if (err == NULL || err->code != ERROR_NONE)
        return false;
    va_list args;
    va_start(args, format);
    vsnprintf(err->text, sizeof err->text, format, args);
    va_end(args);
    size_t len = strlen(err->text);
    snprintf(err->text + len, sizeof err->text - len, ": %s",
             strerrordesc_np(errno_value));
    err->code = code;
    return false;
}

bool
error_list_add(struct error_list *list, enum error_code code,
               const char *pointer, uint32_t line, uint32_t column,
               const char *hint, const char *fix, const char *format, ...)
{
    if (list == NULL)
        return false;
    if (list->count == ERROR_LIST_MAX) {
        list->truncated = true;
        return false;
    }
    va_list args;
    va_start(args, format);
    char *detail = arena_vprintf(list->arena, format, args);
    va_end(args);
    struct error_item *item = &list->items[list->count++];
    *item = (struct error_item){
        .code = code,
        .pointer = pointer ? arena_strdup(list->arena, pointer) : NULL,
        .line = line,
        .column = column,
        .detail = detail ? detail : "no memory is left to say more",
        .hint = hint ? arena_strdup(list->arena, hint) : NULL,
        .fix = fix ? arena_strdup(list->arena, fix) : NULL,
    };
    return false;
}

void
error_list_sort(struct error_list *list)
{
    /* Insertion sort: at most 50 items, and it is stable. */
    for (size_t i = 1; i < list->count; i++) {
        struct error_item item = list->items[i];
        size_t j = i;
        while (j > 0 && (list->items[j - 1].line > item.line ||
                         (list->items[j - 1].line == item.line &&
                          list->items[j - 1].column > item.column))) {
            list->items[j] = list->items[j - 1];
            j--;
        }
        list->items[j] = item;
    }
}
