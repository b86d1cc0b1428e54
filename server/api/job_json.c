#include "server/api/job_json.h"

#include <stdio.h>
#include <string.h>

#include "server/api/examples.h"
#include "server/api/problem.h"

enum { TAG_LENGTH_MAX = 64 };

/* A job document being read. */
struct reading {
    struct job_document *document;
    struct error_list *errors;
};

static void
read_scene(struct reading *r, const struct json *node)
{
    const struct json *named = json_member(node, "$example");

    r->document->scene = node;
    if (named)
        r->document->scene =
            example_read(node, named, r->errors, &r->document->example);
}

static void
read_output(struct reading *r, const struct json *node)
{
    r->document->has_output = true;
    output_read(node, &r->document->output, r->errors);
}

static bool
refuse_type(struct reading *r, const struct json *node, const char *wanted)
{
    return error_list_add(r->errors, ERROR_TYPE_MISMATCH,
                          json_pointer(node, r->errors->arena), node->line,
                          node->column, NULL, NULL, "must be %s, got %s",
                          wanted, json_describe(node, r->errors->arena));
}

static void
read_priority(struct reading *r, const struct json *node)
{
    static const char *const names[] = {"draft", "normal", "low"};
    struct arena *arena = r->errors->arena;
    const char *pointer = json_pointer(node, arena);
    const char *near, *hint = "priority is draft, normal or low", *fix = NULL;
    unsigned i;

    if (node->type != JSON_STRING) {
        refuse_type(r, node, "a string");
        return;
    }
    for (i = 0; i < 3; i++) {
        if (strcmp(node->string, names[i]) == 0) {
            r->document->priority = (enum job_priority)i;
            return;
        }
    }
    near = json_did_you_mean(node->string, names, 3);
    if (near) {
        hint = arena_printf(arena, "Did you mean '%s'?", near);
        fix = arena_printf(
            arena, "[{\"op\":\"replace\",\"path\":\"%s\",\"value\":\"%s\"}]",
            pointer, near);
    }
    error_list_add(r->errors, ERROR_ENUM_UNKNOWN, pointer, node->line,
                   node->column, hint, fix, "unknown priority %s",
                   json_describe(node, arena));
}

/* ^[A-Za-z0-9][A-Za-z0-9_.-]{0,63}$, as every name of a scene */
static bool
is_name(const char *text, size_t len)
{
    size_t i;

    if (len == 0 || len > TAG_LENGTH_MAX)
        return false;
    for (i = 0; i < len; i++) {
        char c = text[i];
        bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                      (c >= '0' && c <= '9');

        if (!letter && (i == 0 || (c != '_' && c != '.' && c != '-')))
            return false;
    }
    return true;
}

static bool
has_tag(const struct json *tags, const struct json *until)
{
    const struct json *tag;

    for (tag = tags->child; tag != until; tag = tag->next)
        if (tag->type == JSON_STRING && strcmp(tag->string, until->string) == 0)
            return true;
    return false;
}

static void
read_tag(struct reading *r, const struct json *tags, const struct json *tag)
{
    struct arena *arena = r->errors->arena;
    char *to = r->document->tags;
    size_t len = strlen(to);

    if (tag->type != JSON_STRING)
        refuse_type(r, tag, "a string");
    else if (!is_name(tag->string, tag->string_len))
        error_list_add(r->errors, ERROR_STRING_PATTERN,
                       json_pointer(tag, arena), tag->line, tag->column,
                       "a letter or digit, then at most 63 letters, digits, "
                       "'_', '.' or '-'",
                       NULL, "a tag is a name, got %s",
                       json_describe(tag, arena));
    else if (has_tag(tags, tag))
        error_list_add(r->errors, ERROR_NAME_DUPLICATE,
                       json_pointer(tag, arena), tag->line, tag->column, NULL,
                       NULL, "the tag '%s' is there already", tag->string);
    else if (len + tag->string_len + 2 <= JOB_TAGS_SIZE)
        snprintf(to + len, JOB_TAGS_SIZE - len, "%s%s", len ? "," : "",
                 tag->string);
}

static void
read_tags(struct reading *r, const struct json *node)
{
    const struct json *tag;

    if (node->type != JSON_ARRAY) {
        refuse_type(r, node, "an array of names");
        return;
    }
    if (node->count > JOB_TAG_MAX) {
        error_list_add(r->errors, ERROR_ARRAY_LENGTH,
                       json_pointer(node, r->errors->arena), node->line,
                       node->column, NULL, NULL, "at most %d tags, got %u",
                       JOB_TAG_MAX, node->count);
        return;
    }
    for (tag = node->child; tag; tag = tag->next)
        read_tag(r, node, tag);
}

static void
read_max_attempts(struct reading *r, const struct json *node)
{
    struct arena *arena = r->errors->arena;
    enum error_code code;

    if (node->type != JSON_NUMBER) {
        refuse_type(r, node, "a number");
        return;
    }
    if (node->number < 1)
        code = ERROR_NUMBER_TOO_SMALL;
    else if (node->number > JOB_ATTEMPTS_LIMIT)
        code = ERROR_NUMBER_TOO_LARGE;
    else if (node->number != (double)(uint32_t)node->number)
        code = ERROR_NUMBER_NOT_INTEGER;
    else {
        r->document->max_attempts = (uint32_t)node->number;
        return;
    }
    error_list_add(r->errors, code, json_pointer(node, arena), node->line,
                   node->column, NULL, NULL,
                   "must be a whole number from 1 to %d, got %s",
                   JOB_ATTEMPTS_LIMIT, json_describe(node, arena));
}

static void
refuse_not_yet(struct reading *r, const struct json *node)
{
    error_list_add(r->errors, ERROR_PROPERTY_NOT_YET,
                   json_pointer(node, r->errors->arena), node->key_line,
                   node->key_column,
                   "leave it out; a later version will have it", NULL,
                   "'%s' is part of a job, but this version does not do it yet",
                   node->key);
}

static const struct {
    const char *name;
    void (*read)(struct reading *r, const struct json *node);
} members[] = {
    {"scene", read_scene},
    {"output", read_output},
    {"priority", read_priority},
    {"tags", read_tags},
    {"max_attempts", read_max_attempts},
    {"time_limit", refuse_not_yet},
    {"frames", refuse_not_yet},
    {"webhook", refuse_not_yet},
};

enum { MEMBER_COUNT = sizeof members / sizeof members[0] };

static void
refuse_unknown(struct reading *r, const struct json *node)
{
    const char *names[MEMBER_COUNT];
    struct arena *arena = r->errors->arena;
    const char *pointer = json_pointer(node, arena);
    const char *hint = "a job has scene, output, priority, tags and "
                       "max_attempts";
    const char *near, *fix = NULL;
    size_t i;

    for (i = 0; i < MEMBER_COUNT; i++)
        names[i] = members[i].name;
    near = json_did_you_mean(node->key, names, MEMBER_COUNT);
    if (near) {
        hint = arena_printf(arena, "Did you mean '%s'?", near);
        if (!json_member(node->parent, near))
            fix = arena_printf(
                arena, "[{\"op\":\"move\",\"from\":%s,\"path\":\"/%s\"}]",
                json_quoted(pointer, arena), near);
    }
    error_list_add(r->errors, ERROR_PROPERTY_UNKNOWN, pointer, node->key_line,
                   node->key_column, hint, fix, "unknown property '%.64s'",
                   node->key);
}

bool
job_json_read(const struct json *root, struct job_document *document,
              struct error_list *errors)
{
    struct reading r = {document, errors};
    size_t before = errors->count;
    const struct json *node;
    size_t i;

    memset(document, 0, sizeof *document);
    output_default(&document->output);
    document->priority = PRIORITY_NORMAL;
    document->max_attempts = JOB_ATTEMPTS_DEFAULT;
    document->prefix = "";
    if (!json_member(root, "scene")) {
        document->scene = root;
        return true;
    }
    document->is_job = true;
    document->prefix = "/scene";
    for (node = root->child; node; node = node->next) {
        for (i = 0; i < MEMBER_COUNT; i++)
            if (strcmp(node->key, members[i].name) == 0)
                break;
        if (i < MEMBER_COUNT)
            members[i].read(&r, node);
        else
            refuse_unknown(&r, node);
    }
    return errors->count == before;
}
