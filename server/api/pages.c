#include "server/api/pages.h"

#include <string.h>
#include <strings.h>

#include "server/api/files.h"
#include "server/api/html.h"
#include "server/api/routes.h"

/* Shown in the form before anything was posted. */
static const char first_scene[] = "schemas/examples/course-table-fresnel.json";

/* What the program itself says on a page; the rest is in server/web. */
static const struct words {
    const char *lang, *form, *line, *column, *help, *picture, *download, *go_on;
} languages[] = {
    {"en", "server/web/form.en.html", "line", "column", "help",
     "the rendered scene", "the image as a file",
     "The job goes on; its result will be at"},
    {
        "de",
        "server/web/form.de.html",
        "Zeile",
        "Spalte",
        "Hilfe",
        "die gerechnete Szene",
        "das Bild als Datei",
        "Der Auftrag l\xc3\xa4uft weiter; hier wird sein Ergebnis stehen:",
    },
};

static const struct words *
words_of(struct call *call)
{
    static const char *const codes[] = {"en", "de"};
    const char *lang = request_query(call->request, "lang");

    if (lang)
        return &languages[strcmp(lang, "de") == 0];
    return &languages[language_choose(
        request_header(call->request, "Accept-Language"), codes, 2)];
}

/* Headers of every page. */
static enum http_verdict
send_page(struct call *call, unsigned status, const struct words *words,
          struct bytes *html)
{
    struct request *request = call->request;

    reply_header(request, call->reply, "Content-Security-Policy",
                 "default-src 'self'; img-src 'self' blob: data:; object-src "
                 "'none'; base-uri 'none'; frame-ancestors 'none'; "
                 "form-action 'self'");
    reply_header(request, call->reply, "Referrer-Policy", "same-origin");
    reply_header(request, call->reply, "Content-Language", "%s", words->lang);
    reply_header(request, call->reply, "Vary", "Accept, Accept-Language");
    reply_header(request, call->reply, "Cache-Control", "no-cache");
    return call_body(call, status, "text/html; charset=utf-8", html);
}

static void
put(struct bytes *out, const char *text)
{
    if (text)
        html_text(out, text, strlen(text));
}

/* --- the form --- */

/* server/web/form.*.html with {{scene}} and {{answer}} filled in. */
static enum http_verdict
send_form(struct call *call, unsigned status, const struct words *words,
          const char *scene, size_t scene_len, const struct bytes *answer)
{
    const struct file *page = file_find(words->form);
    const char *at = page ? (const char *)page->data : "";
    struct bytes html = {0};

    while (*at) {
        const char *mark = strstr(at, "{{");

        if (!mark) {
            bytes_text(&html, at);
            break;
        }
        bytes_append(&html, at, (size_t)(mark - at));
        if (strncmp(mark, "{{scene}}", 9) == 0)
            html_text(&html, scene, scene_len);
        else if (answer && strncmp(mark, "{{answer}}", 10) == 0)
            bytes_append(&html, answer->data ? answer->data : "", answer->len);
        at = strstr(mark, "}}");
        at = at ? at + 2 : "";
    }
    return send_page(call, status, words, &html);
}

static void
put_place(struct bytes *html, const struct words *words,
          const struct error_item *item)
{
    if (item->line > 0)
        bytes_printf(html, "%s %u, %s %u: ", words->line, item->line,
                     words->column, item->column);
}

static void
put_errors(struct bytes *html, const struct words *words,
           const struct error_list *errors)
{
    size_t i;

    bytes_text(html, "<ol>\n");
    for (i = 0; i < errors->count; i++) {
        const struct error_item *item = &errors->items[i];
        const char *code = error_code_name(item->code);

        bytes_text(html, "<li>");
        put_place(html, words, item);
        put(html, item->pointer);
        bytes_text(html, " ");
        put(html, item->detail);
        if (item->hint) {
            bytes_text(html, " <em>");
            put(html, item->hint);
            bytes_text(html, "</em>");
        }
        bytes_printf(html, " <a href=\"/problems/%s#%s\">%s</a></li>\n",
                     strncmp(code, "json.", 5) == 0 ? "json-syntax"
                                                    : "scene-invalid",
                     code, code);
    }
    bytes_text(html, "</ol>\n");
}

/* visit->show_problem of a posted form. */
static void
show_problem(struct call *call, const struct problem *problem)
{
    const struct words *words = words_of(call);
    const char *scene = call->visit->form_scene;
    struct bytes html = {0};

    bytes_text(&html, "<section role=\"alert\" class=\"problem\">\n<h2>");
    put(&html, problem_title(problem->kind));
    bytes_text(&html, "</h2>\n<p>");
    put(&html, problem->detail);
    bytes_printf(&html, " <a href=\"/problems/%s\">%s</a></p>\n",
                 problem_slug(problem->kind), words->help);
    if (problem->errors)
        put_errors(&html, words, problem->errors);
    if (problem->kind == PROBLEM_SYNC_TIMEOUT)
        bytes_printf(&html, "<p>%s <a href=\"/v1/jobs/%s/result\">%s</a></p>\n",
                     words->go_on, call->visit->job, call->visit->job);
    bytes_text(&html, "</section>\n");
    if (problem_status(problem->kind) == 503)
        reply_header(call->request, call->reply, "Retry-After", "%u",
                     problem->retry_after_s ? problem->retry_after_s : 2);
    send_form(call, problem_status(problem->kind), words, scene ? scene : "",
              scene ? strlen(scene) : 0, &html);
    bytes_clear(&html);
}

/* The value of the form's only field; false if the body is something else. */
static bool
scene_field(struct call *call, size_t *len)
{
    static const char name[] = "scene=";
    const char *body = call->request->body;
    size_t body_len = call->request->body_len;
    char *text;

    if (body_len < strlen(name) || memcmp(body, name, strlen(name)) != 0 ||
        memchr(body, '&', body_len))
        return false;
    body += strlen(name);
    body_len -= strlen(name);
    text = arena_alloc(call->request->arena, body_len + 1);
    if (!text)
        return false;
    *len = form_decode(body, body_len, text);
    call->visit->form_scene = text;
    return true;
}

bool
page_read_form(struct call *call, size_t *len)
{
    const char *type = request_header(call->request, "Content-Type");

    call->visit->show_problem = show_problem;
    if (!type ||
        strncasecmp(type, "application/x-www-form-urlencoded", 33) != 0) {
        call_problem(call, PROBLEM_UNSUPPORTED_MEDIA_TYPE,
                     "this address takes the form of its page; programs use "
                     "POST /v1/render");
        return false;
    }
    if (!scene_field(call, len)) {
        call_problem(call, PROBLEM_REQUEST_MALFORMED,
                     "the form has one field, scene");
        return false;
    }
    if (*len > call->api->options.max_scene_bytes) {
        call_problem(call, PROBLEM_TOO_LARGE,
                     "the scene has %zu bytes, at most %llu are read", *len,
                     (unsigned long long)call->api->options.max_scene_bytes);
        return false;
    }
    return true;
}

enum http_verdict
page_picture(struct call *call, const struct job *job)
{
    const struct words *words = words_of(call);
    bool shown = strcmp(job->media_type, "image/png") == 0;
    const char *scene = call->visit->form_scene;
    struct bytes html = {0};
    enum http_verdict verdict;

    bytes_text(&html, "<section class=\"picture\">\n");
    if (shown)
        bytes_printf(&html,
                     "<p><img src=\"/v1/jobs/%s/result\" alt=\"%s\"></p>\n",
                     job->id, words->picture);
    bytes_printf(&html,
                 "<p><a href=\"/v1/jobs/%s/result\">%s</a></p>\n</section>\n",
                 job->id, words->download);
    verdict = send_form(call, 200, words, scene, strlen(scene), &html);
    bytes_clear(&html);
    return verdict;
}

enum http_verdict
page_form(struct call *call)
{
    const struct file *scene = file_find(first_scene);

    return send_form(call, 200, words_of(call),
                     scene ? (const char *)scene->data : "",
                     scene ? scene->len : 0, NULL);
}

enum http_verdict
page_style(struct call *call)
{
    const struct file *file = file_find("server/web/style.css");

    if (!file)
        return call_problem(call, PROBLEM_INTERNAL,
                            "this program was built without its style");
    return call_file(call, file, "text/css; charset=utf-8");
}

/* --- help pages --- */

/* docs/problems/{slug}.md is English, a line "---", German. */
static void
put_help(struct bytes *html, const struct file *file, bool german, bool first)
{
    static const char cut[] = "\n---\n";
    const char *text = (const char *)file->data;
    const char *middle = strstr(text, cut);
    size_t english = middle ? (size_t)(middle - text) + 1 : file->len;

    bytes_printf(html, "<section lang=\"%s\">\n", german ? "de" : "en");
    if (german && middle)
        html_marks(html, middle + strlen(cut),
                   file->len - (size_t)(middle - text) - strlen(cut),
                   first ? "" : "-de");
    else if (!german)
        html_marks(html, text, english, first ? "" : "-en");
    bytes_text(html, "</section>\n");
}

enum http_verdict
page_problem(struct call *call)
{
    static const char *const types[] = {"text/html", "text/markdown",
                                        "text/plain"};
    const struct words *words = words_of(call);
    bool german = strcmp(words->lang, "de") == 0;
    const char *format = request_query(call->request, "format");
    const char *name =
        arena_printf(call->request->arena, "docs/problems/%s.md", call->param);
    const struct file *file = name ? file_find(name) : NULL;
    struct bytes html = {0};
    int type;

    if (!file)
        return call_problem(call, PROBLEM_NOT_FOUND,
                            "there is no problem '%.64s'", call->param);
    type = format ? strcmp(format, "text") == 0   ? 2
                    : strcmp(format, "html") == 0 ? 0
                                                  : -1
                  : accept_choose(request_header(call->request, "Accept"),
                                  types, 3);
    if (type < 0)
        return call_not_acceptable(call, types, 3,
                                   "a help page is HTML or text (?format=html "
                                   "or text)");
    if (type > 0)
        return call_file(call, file,
                         type == 1 ? "text/markdown; charset=utf-8"
                                   : "text/plain; charset=utf-8");
    bytes_printf(&html,
                 "<!DOCTYPE html>\n<html lang=\"%s\">\n<head>\n"
                 "<meta charset=\"utf-8\">\n"
                 "<meta name=\"viewport\" content=\"width=device-width\">\n"
                 "<title>%s - Glint</title>\n"
                 "<link rel=\"stylesheet\" href=\"/style.css\">\n</head>\n"
                 "<body>\n<main>\n",
                 words->lang, call->param);
    put_help(&html, file, german, true);
    bytes_text(&html, "<hr>\n");
    put_help(&html, file, !german, false);
    bytes_text(&html, "<p><a href=\"/\">Glint</a></p>\n</main>\n</body>\n"
                      "</html>\n");
    return send_page(call, 200, words, &html);
}
