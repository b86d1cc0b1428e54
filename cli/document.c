#include "cli/document.h"

#include <string.h>

#include "cli/examples.h"
#include "cli/patch.h"
#include "core/scene/scene_json.h"

enum {
    READ_MAX = 16 * 1024 * 1024 /* json_read refuses long before, with a code */
};

enum member_use { USE_HERE, USE_ON_SERVER, USE_NOT_YET };

/* The members of a job document (API section 1). */
static const struct {
    const char *name;
    enum member_use use;
} job_members[] = {
    {"scene", USE_HERE},
    {"output", USE_HERE},
    {"priority", USE_ON_SERVER},
    {"tags", USE_ON_SERVER},
    {"max_attempts", USE_ON_SERVER},
    {"time_limit", USE_NOT_YET},
    {"frames", USE_NOT_YET},
    {"webhook", USE_NOT_YET},
};

enum { JOB_MEMBER_COUNT = sizeof job_members / sizeof *job_members };

/* Text -> tree, and where scene and output stand in it. */
static void
parse(struct document *document)
{
    struct error_list *errors = &document->errors;
    errors->count = 0;
    document->scene_root = document->output_root = NULL;
    const char *text = document->text.data ? document->text.data : "";
    document->root =
        json_read(text, document->text.len, NULL, &document->arena, errors);
    if (document->root == NULL)
        return;
    const struct json *scene = json_member(document->root, "scene");
    document->is_job = scene != NULL;
    document->scene_root = scene != NULL ? scene : document->root;
    if (scene != NULL)
        document->output_root = json_member(document->root, "output");
}

/* {"scene": {"$example": "smallest"}} -> the text of that example. */
static void
expand_example(struct document *document)
{
    const struct json *scene = document->scene_root;
    const struct json *name =
        document->is_job ? json_member(scene, "$example") : NULL;
    if (name == NULL || name->type != JSON_STRING || scene->count != 1)
        return;
    const struct example *example = example_find(name->string);
    if (example == NULL) {
        const char *near = example_near(name->string);
        const char *hint =
            near ? arena_printf(&document->arena, "did you mean `%s`?", near)
                 : "`glint examples` lists them";
        error_list_add(&document->errors, ERROR_REFERENCE_UNKNOWN,
                       "/scene/$example", name->line, name->column, hint, NULL,
                       "there is no example `%.80s`", name->string);
        document->root = NULL;
        return;
    }
    patch_splice(&document->text, scene->begin, scene->end, example->text,
                 example->len);
    parse(document);
}

bool
document_open(struct document *document, const char *path, struct error *err)
{
    document->name = strcmp(path, "-") == 0 ? "standard input" : path;
    arena_init(&document->arena, 0);
    document->errors.arena = &document->arena;
    output_default(&document->output);
    if (!bytes_read_file(&document->text, path, READ_MAX, err))
        return false;
    parse(document);
    if (document->root != NULL)
        expand_example(document);
    return true;
}

bool
document_set(struct document *document, const char *assignment,
             struct error *err)
{
    if (document->root == NULL)
        return true;
    if (document->set_count == DOCUMENT_SET_MAX)
        return error_set(err, ERROR_USAGE, "--set is given more than %d times",
                         DOCUMENT_SET_MAX);
    const char *place = NULL;
    if (!patch_set(&document->text, assignment, &document->arena, &place, err))
        return false;
    document->sets[document->set_count].assignment = assignment;
    document->sets[document->set_count++].place = place;
    parse(document);
    if (document->root != NULL)
        expand_example(document);
    return true;
}

/* ---- the members of a job ---- */

static bool
wrong(struct document *document, const struct json *node, enum error_code code,
      const char *hint, const char *must)
{
    struct arena *arena = &document->arena;
    return error_list_add(&document->errors, code, json_pointer(node, arena),
                          node->line, node->column, hint, NULL,
                          "must be %s, got %s", must,
                          json_describe(node, arena));
}

static void
check_priority(struct document *document, const struct json *node)
{
    static const char *const names[] = {"draft", "normal", "low"};
    if (node->type != JSON_STRING) {
        wrong(document, node, ERROR_TYPE_MISMATCH, NULL, "a string");
        return;
    }
    for (size_t i = 0; i < 3; i++) {
        if (strcmp(node->string, names[i]) == 0)
            return;
    }
    wrong(document, node, ERROR_ENUM_UNKNOWN, NULL, "draft, normal or low");
}

static void
check_max_attempts(struct document *document, const struct json *node)
{
    if (node->type != JSON_NUMBER)
        wrong(document, node, ERROR_TYPE_MISMATCH, NULL, "a number");
    else if (node->number < 1)
        wrong(document, node, ERROR_NUMBER_TOO_SMALL, NULL, "at least 1");
    else if (node->number > 10)
        wrong(document, node, ERROR_NUMBER_TOO_LARGE, NULL, "at most 10");
    else if (node->number != (double)(int)node->number)
        wrong(document, node, ERROR_NUMBER_NOT_INTEGER, NULL, "a whole number");
}

static void
check_tags(struct document *document, const struct json *node)
{
    if (node->type != JSON_ARRAY) {
        wrong(document, node, ERROR_TYPE_MISMATCH, NULL, "an array of names");
        return;
    }
    if (node->count > 16)
        wrong(document, node, ERROR_ARRAY_LENGTH, NULL, "at most 16 names");
    for (const struct json *tag = node->child; tag; tag = tag->next) {
        if (tag->type != JSON_STRING)
            wrong(document, tag, ERROR_TYPE_MISMATCH, NULL, "a string");
    }
}

static void
unknown_member(struct document *document, const struct json *node)
{
    const char *names[JOB_MEMBER_COUNT];
    for (size_t i = 0; i < JOB_MEMBER_COUNT; i++)
        names[i] = job_members[i].name;
    const char *near = json_did_you_mean(node->key, names, JOB_MEMBER_COUNT);
    const char *hint =
        near ? arena_printf(&document->arena, "did you mean `%s`?", near)
             : "beside scene, a job has output, priority, tags and "
               "max_attempts; all else belongs into the scene";
    error_list_add(&document->errors, ERROR_PROPERTY_UNKNOWN,
                   json_pointer(node, &document->arena), node->key_line,
                   node->key_column, hint, NULL, "unknown property `%.80s`",
                   node->key);
}

static void
check_member(struct document *document, const struct json *node)
{
    for (size_t i = 0; i < JOB_MEMBER_COUNT; i++) {
        if (strcmp(job_members[i].name, node->key) != 0)
            continue;
        if (job_members[i].use == USE_NOT_YET)
            error_list_add(&document->errors, ERROR_PROPERTY_NOT_YET,
                           json_pointer(node, &document->arena), node->key_line,
                           node->key_column, NULL, NULL,
                           "this version has no `%s` yet", node->key);
        return;
    }
    unknown_member(document, node);
}

static void
check_job(struct document *document)
{
    for (const struct json *m = document->root->child; m; m = m->next) {
        check_member(document, m);
        if (strcmp(m->key, "priority") == 0)
            check_priority(document, m);
        else if (strcmp(m->key, "max_attempts") == 0)
            check_max_attempts(document, m);
        else if (strcmp(m->key, "tags") == 0)
            check_tags(document, m);
    }
    output_read(document->output_root, &document->output, &document->errors);
}

bool
document_check(struct document *document)
{
    struct error_list *errors = &document->errors;
    if (document->root == NULL)
        return false;
    errors->count = 0;
    errors->truncated = false;
    if (document->is_job)
        check_job(document);
    bool valid = scene_read(document->scene_root, NULL, &document->arena,
                            &document->scene, errors);
    error_list_sort(errors);
    document->lint_count = 0;
    if (valid)
        document->lint_count =
            scene_lint(document->scene_root, &document->scene, &document->arena,
                       &document->lint);
    return valid && errors->count == 0;
}

/* ---- telling ---- */

/* The --set that touched this pointer, or NULL. */
static const char *
set_of(const struct document *document, const char *pointer)
{
    for (size_t i = document->set_count; pointer != NULL && i-- > 0;) {
        const char *place = document->sets[i].place;
        size_t len = place != NULL ? strlen(place) : 0;
        if (len > 0 && strncmp(pointer, place, len) == 0 &&
            (pointer[len] == '\0' || pointer[len] == '/'))
            return document->sets[i].assignment;
    }
    return NULL;
}

void
document_print(const struct document *document, const struct channel *to,
               const struct finding *finding)
{
    const char *set = set_of(document, finding->pointer);
    if (set == NULL) {
        finding_print(to, document->name, document->text.data,
                      document->text.len, finding);
        return;
    }
    struct bytes name = {0};
    struct finding placeless = *finding;
    placeless.line = placeless.column = 0;
    bytes_printf(&name, "--set %.200s", set);
    finding_print(to, name.data ? name.data : "--set", NULL, 0, &placeless);
    bytes_clear(&name);
}

void
document_print_all(const struct document *document, const struct channel *to,
                   bool warnings)
{
    for (size_t i = 0; i < document->errors.count; i++) {
        struct finding f = finding_of_error(&document->errors.items[i]);
        document_print(document, to, &f);
    }
    if (document->errors.truncated)
        fprintf(to->file, "%s: more than %d errors, these are the first\n",
                document->name, ERROR_LIST_MAX);
    for (size_t i = 0; warnings && i < document->lint_count; i++) {
        struct finding f = finding_of_lint(&document->lint[i]);
        document_print(document, to, &f);
    }
}

void
document_write_job(const struct document *document, const char *output,
                   struct bytes *job, unsigned *lines_before)
{
    const char *text = document->text.data;
    size_t len = document->text.len;

    *lines_before = 0;
    if (!document->is_job) {
        /* A byte-order mark may stand only at the very front. */
        bool mark = len >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0;
        bytes_printf(job, "{\"output\": %s, \"scene\":\n", output);
        bytes_append(job, text + (mark ? 3 : 0), len - (mark ? 3 : 0));
        bytes_text(job, "\n}\n");
        *lines_before = 1;
        return;
    }
    bytes_append(job, text, len);
    const struct json *old = document->output_root;
    if (old != NULL) {
        patch_splice(job, old->begin, old->end, output, strlen(output));
        return;
    }
    /* Behind the last member, so that no column before it moves. */
    const struct json *last = document->root->child;
    while (last->next != NULL)
        last = last->next;
    struct bytes member = {0};
    bytes_printf(&member, ", \"output\": %s", output);
    patch_splice(job, last->end, last->end, member.data, member.len);
    bytes_clear(&member);
}

void
document_clear(struct document *document)
{
    bytes_clear(&document->text);
    arena_clear(&document->arena);
    *document = (struct document){0};
}
