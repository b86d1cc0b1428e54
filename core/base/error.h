/* error.h - what went wrong, said once, in one sentence.
 *
 * Two containers share one table of codes. `struct error` is a single failure
 * on its way up a call chain; it lives on the caller's stack, the first writer
 * wins and nobody rewraps it. `struct error_list` collects everything that is
 * wrong with a document, each item with its place in the text.
 *
 * A sentence is lower case, has no full stop and names the value:
 * "radius must be greater than 0, got -1". Codes are public and never reused.
 * No function here fails; all are free of shared state. */
#ifndef CORE_BASE_ERROR_H
#define CORE_BASE_ERROR_H

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct arena;

/* One row per code: name in C, name in JSON. The first group describes
 * documents (SCENE section 8), the second everything else that can fail. */
#define ERROR_TABLE(X)                                                         \
    X(ERROR_NONE, "none")                                                      \
    X(ERROR_JSON_SYNTAX, "json.syntax")                                        \
    X(ERROR_JSON_TRAILING_DATA, "json.trailing_data")                          \
    X(ERROR_JSON_DUPLICATE_KEY, "json.duplicate_key")                          \
    X(ERROR_JSON_NUMBER_RANGE, "json.number_range")                            \
    X(ERROR_JSON_DEPTH, "json.depth")                                          \
    X(ERROR_JSON_UTF8, "json.utf8")                                            \
    X(ERROR_JSON_CONTROL_CHARACTER, "json.control_character")                  \
    X(ERROR_PROPERTY_UNKNOWN, "property.unknown")                              \
    X(ERROR_PROPERTY_NOT_YET, "property.not_yet")                              \
    X(ERROR_PROPERTY_MISSING, "property.missing")                              \
    X(ERROR_PROPERTY_CONFLICT, "property.conflict")                            \
    X(ERROR_TYPE_MISMATCH, "type.mismatch")                                    \
    X(ERROR_ENUM_UNKNOWN, "enum.unknown")                                      \
    X(ERROR_ENUM_NOT_YET, "enum.not_yet")                                      \
    X(ERROR_NUMBER_TOO_SMALL, "number.too_small")                              \
    X(ERROR_NUMBER_TOO_LARGE, "number.too_large")                              \
    X(ERROR_NUMBER_NOT_INTEGER, "number.not_integer")                          \
    X(ERROR_ARRAY_LENGTH, "array.length")                                      \
    X(ERROR_STRING_LENGTH, "string.length")                                    \
    X(ERROR_STRING_PATTERN, "string.pattern")                                  \
    X(ERROR_COLOR_INVALID, "color.invalid")                                    \
    X(ERROR_NAME_DUPLICATE, "name.duplicate")                                  \
    X(ERROR_REFERENCE_UNKNOWN, "reference.unknown")                            \
    X(ERROR_REFERENCE_CYCLE, "reference.cycle")                                \
    X(ERROR_VECTOR_ZERO, "vector.zero")                                        \
    X(ERROR_TRANSFORM_SINGULAR, "transform.singular")                          \
    X(ERROR_TRANSFORM_NOT_UNIFORM, "transform.not_uniform")                    \
    X(ERROR_CAMERA_DEGENERATE, "camera.degenerate")                            \
    X(ERROR_GEOMETRY_DEGENERATE, "geometry.degenerate")                        \
    X(ERROR_MESH_INDEX_RANGE, "mesh.index_range")                              \
    X(ERROR_INTEGRATOR_MATERIAL, "integrator.material_unsupported")            \
    X(ERROR_SAMPLER_CENTER_SPP, "sampler.center_spp")                          \
    X(ERROR_CSG_OPEN_OPERAND, "csg.open_operand")                              \
    X(ERROR_ASSET_MISSING, "asset.missing")                                    \
    X(ERROR_ASSET_UNREADABLE, "asset.unreadable")                              \
    X(ERROR_BUDGET_BYTES, "budget.bytes")                                      \
    X(ERROR_BUDGET_OBJECTS, "budget.objects")                                  \
    X(ERROR_BUDGET_TRIANGLES, "budget.triangles")                              \
    X(ERROR_BUDGET_PIXELS, "budget.pixels")                                    \
    X(ERROR_BUDGET_RAYS, "budget.rays")                                        \
    X(ERROR_BUDGET_DEPTH, "budget.depth")                                      \
    X(ERROR_BUDGET_LIST, "budget.list")                                        \
    X(ERROR_BUDGET_MEMORY, "budget.memory")                                    \
    X(ERROR_LAYER_UNKNOWN, "layer.unknown")                                    \
    X(ERROR_IO, "io")                                                          \
    X(ERROR_MEMORY, "out_of_memory")                                           \
    X(ERROR_CANCELED, "canceled")                                              \
    X(ERROR_TIMEOUT, "timeout")                                                \
    X(ERROR_STALLED, "stalled")                                                \
    X(ERROR_WORKER_CRASHED, "worker_crashed")                                  \
    X(ERROR_PROTOCOL, "protocol")                                              \
    X(ERROR_TOO_LARGE, "too_large")                                            \
    X(ERROR_NOT_FOUND, "not_found")                                            \
    X(ERROR_CONFLICT, "conflict")                                              \
    X(ERROR_QUEUE_FULL, "queue_full")                                          \
    X(ERROR_STORAGE_FULL, "storage_full")                                      \
    X(ERROR_DRAINING, "draining")                                              \
    X(ERROR_USAGE, "usage")                                                    \
    X(ERROR_INTERNAL, "internal")

enum error_code {
#define X(code, name) code,
    ERROR_TABLE(X)
#undef X
        ERROR_CODE_COUNT
};

/* "number.too_small" and the way back; an unknown name gives ERROR_INTERNAL. */
const char *
error_code_name(enum error_code code);
enum error_code
error_code_find(const char *name);

/* One failure. Zero it before use; text is at most 383 bytes and is cut. */
struct error {
    enum error_code code;
    char text[384];
};

/* Set *err unless it is NULL or already set. Always returns false, so that
 * failing is one line: `return error_set(err, ERROR_IO, "...", ...);`. */
bool
error_set(struct error *err, enum error_code code, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* As error_set with ": " and strerror(errno_value) at the end. */
bool
error_errno(struct error *err, enum error_code code, int errno_value,
            const char *format, ...) __attribute__((format(printf, 4, 5)));

/* One thing wrong with a document. All strings live in the list's arena. */
struct error_item {
    enum error_code code;
    const char *pointer; /* RFC 6901 into the document sent; NULL: no place */
    uint32_t line;       /* 1-based; 0 with no place */
    uint32_t column;     /* 1-based, counted in characters */
    const char *detail;  /* one sentence */
    const char *hint;    /* how to mend it, or NULL */
    const char *fix;     /* JSON Patch text (an array), or NULL */
};

enum {
    ERROR_LIST_MAX = 50 /* more set `truncated` (API section 4) */
};

/* Zero it, set `arena`, collect. `count` never passes ERROR_LIST_MAX. Items
 * stand in the order added until error_list_sort. */
struct error_list {
    struct arena *arena;
    struct error_item items[ERROR_LIST_MAX];
    size_t count;
    bool truncated;
};

/* Add one item; pointer, hint and fix may be NULL and are copied into the
 * arena. Returns false, like error_set. */
bool
error_list_add(struct error_list *list, enum error_code code,
               const char *pointer, uint32_t line, uint32_t column,
               const char *hint, const char *fix, const char *format, ...)
    __attribute__((format(printf, 8, 9)));

/* Document order: by line, then column; items without a place come first.
 * Stable. */
void
error_list_sort(struct error_list *list);

#endif
