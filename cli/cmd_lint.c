/* glint lint FILE... */
#include <string.h>

#include "cli/command.h"
#include "cli/document.h"
#include "cli/exit.h"
#include "cli/output.h"
#include "core/base/json_write.h"

struct tally {
    size_t files, errors, warnings;
    bool unreadable;
};

/* What a server would answer: a problem body with the file's name in it. A
 * valid document has no problem, only its warnings. */
static void
print_json(const struct document *document, bool valid)
{
    struct bytes out = {0};
    struct json_writer w = {.out = &out};
    const struct error_list *errors = &document->errors;
    bool syntax = !valid && document->root == NULL;

    json_begin_object(&w, NULL);
    json_put_string(&w, "file", document->name);
    json_put_bool(&w, "valid", valid);
    if (!valid) {
        json_put_string(&w, "type",
                        syntax ? "/problems/json-syntax"
                               : "/problems/scene-invalid");
        json_put_string(&w, "title",
                        syntax ? "The document is not valid JSON"
                               : "The scene is not valid");
        json_put_integer(&w, "status", syntax ? 400 : 422);
        struct bytes detail = {0};
        bytes_printf(&detail, "%zu %s; the first: %s%s%s.", errors->count,
                     errors->count == 1 ? "error" : "errors",
                     errors->items[0].pointer ? errors->items[0].pointer : "",
                     errors->items[0].pointer ? " " : "",
                     errors->items[0].detail);
        json_put_string(&w, "detail", detail.data ? detail.data : "");
        bytes_clear(&detail);
    }
    json_begin_array(&w, "errors");
    for (size_t i = 0; i < errors->count; i++) {
        struct finding f = finding_of_error(&errors->items[i]);
        finding_write(&w, &f);
    }
    json_end_array(&w);
    if (errors->truncated)
        json_put_bool(&w, "errors_truncated", true);
    json_begin_array(&w, "warnings");
    for (size_t i = 0; i < document->lint_count; i++) {
        struct finding f = finding_of_lint(&document->lint[i]);
        finding_write(&w, &f);
    }
    json_end_array(&w);
    json_end_object(&w);
    if (!out.failed)
        printf("%s\n", out.data);
    bytes_clear(&out);
}

static void
lint_file(const struct invocation *in, const char *path,
          const struct channel *findings, const struct channel *messages,
          struct tally *tally)
{
    struct document document = {0};
    struct error err = {0};

    if (!document_open(&document, path, &err)) {
        say_error(messages, "glint lint", "%s", err.text);
        tally->unreadable = true;
        goto out;
    }
    bool valid = document_check(&document);
    if (invocation_has(in, "json"))
        print_json(&document, valid);
    else
        document_print_all(&document, findings, !invocation_has(in, "quiet"));
    tally->files++;
    tally->errors += document.errors.count;
    tally->warnings += document.lint_count;
out:
    document_clear(&document);
}

static void
put_count(FILE *to, size_t count, const char *noun, const char *after)
{
    fprintf(to, "%zu %s%s%s", count, noun, count == 1 ? "" : "s", after);
}

int
cmd_lint(const struct invocation *in)
{
    bool no_color = invocation_has(in, "no-color");
    struct channel findings = channel_open(stdout, no_color);
    struct channel messages = channel_open(stderr, no_color);
    struct tally tally = {0};

    for (size_t i = 0; i < in->arg_count; i++)
        lint_file(in, in->args[i], &findings, &messages, &tally);
    if (!invocation_has(in, "json") && !invocation_has(in, "quiet") &&
        tally.files > 0) {
        put_count(stdout, tally.files, "file", ", ");
        put_count(stdout, tally.errors, "error", ", ");
        put_count(stdout, tally.warnings, "warning", "\n");
    }
    return tally.unreadable   ? STATUS_USAGE
           : tally.errors > 0 ? STATUS_NO
                              : STATUS_OK;
}
