#include "server/config.h"

#include <arpa/inet.h>
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#include "core/base/arena.h"
#include "core/base/bytes.h"
#include "core/base/isa.h"
#include "core/base/json.h"

extern char **environ;

enum { EXIT_OK = 0, EXIT_USAGE = 2, EXIT_CONFIG = 3 };
enum { FILE_BYTES_MAX = 1 << 20, ORIGIN_SIZE = 1200 };

/* What a value may be. */
enum kind {
    KIND_ADDRESS, /* host:port */
    KIND_PATH,
    KIND_COUNT,  /* unsigned, or "auto" */
    KIND_SWITCH, /* on, off */
    KIND_LEVEL,
    KIND_FORMAT,
    KIND_UNSIGNED,
    KIND_U32,
    KIND_U64,
    KIND_SECONDS,
    KIND_FILE,   /* --config itself: no key in the file */
    KIND_NOT_YET /* API section 9 names it, this build does not have it */
};

struct setting {
    const char *name; /* as in the file; dashes in a flag, capitals in the
                         environment */
    enum kind kind;
    const char *standard; /* default */
    double least, most;   /* numbers: inclusive */
    size_t offset;        /* in struct config */
    const char *value;    /* placeholder in --help */
    const char *help;
};

#define AT(member) offsetof(struct config, member)

/* One row per setting: flag, environment, file key, default, range and help all
 * follow from it. */
static const struct setting settings[] = {
    {"listen", KIND_ADDRESS, "127.0.0.1:8080", 0, 0, 0, "HOST:PORT",
     "where to listen; [::1]:8080, :8080 (127.0.0.1); port 0: any free one"},
    {"data", KIND_PATH, "./glint-data", 0, 0, AT(data), "DIR",
     "folder of the jobs and results; made if it is not there"},
    {"workers", KIND_COUNT, "auto", 1, 256, AT(workers), "N",
     "worker processes; auto: a worker per 8 cores, at least 2"},
    {"threads", KIND_COUNT, "auto", 1, 1024, AT(threads), "N",
     "threads shared out among running jobs; auto: one per core"},
    {"insecure_open", KIND_SWITCH, "off", 0, 0, AT(insecure_open), NULL,
     "allow to listen beyond this machine although nobody is asked for a key"},
    {"log_level", KIND_LEVEL, "info", 0, 0, AT(log_level), "LEVEL",
     "debug, info, warn or error"},
    {"log_format", KIND_FORMAT, "auto", 0, 0, AT(log_format), "FORMAT",
     "text, json, or auto: text on a terminal, else JSON lines"},
    {"max_scene_bytes", KIND_U64, "1048576", 1024, 67108864,
     AT(max_scene_bytes), "BYTES",
     "largest scene, and body of a submission; parsed it takes 40 times that"},
    {"max_pixels", KIND_U64, "16777216", 1, 16777216,
     AT(scene_limits.max_pixels), "N", "largest film"},
    {"max_triangles", KIND_U64, "10000000", 1, 10000000,
     AT(scene_limits.max_triangles), "N", "triangles of a scene"},
    {"max_rays", KIND_U64, "2e10", 1, 2e10, AT(scene_limits.max_rays), "N",
     "estimated rays of a job"},
    {"max_spp", KIND_U32, "65536", 1, 65536, AT(scene_limits.max_spp), "N",
     "samples per pixel"},
    {"max_bounces", KIND_U32, "64", 1, 64, AT(scene_limits.max_bounces), "N",
     "bounces of a ray"},
    {"max_render_seconds", KIND_SECONDS, "600", 0.1, 86400,
     AT(max_render_seconds), "S", "wall clock of one attempt at a job"},
    {"max_render_bytes", KIND_U64, "2147483648", 16777216, 1099511627776.,
     AT(max_render_bytes), "BYTES", "memory of one render, and of its result"},
    {"stall_seconds", KIND_SECONDS, "60", 0.5, 3600, AT(stall_seconds), "S",
     "a worker that says nothing for so long is killed and replaced"},
    {"default_wait", KIND_SECONDS, "20", 0, 3600, AT(default_wait), "S",
     "how long POST /v1/render waits for the picture by default"},
    {"max_wait", KIND_SECONDS, "60", 0, 3600, AT(max_wait), "S",
     "how long a client may ask to wait"},
    {"max_connections", KIND_UNSIGNED, "10240", 1, 1000000, AT(max_connections),
     "N", "open connections; lowered at start if descriptors do not suffice"},
    {"max_queued", KIND_U32, "100000", 1, 10000000, AT(max_queued), "N",
     "jobs waiting; beyond it submissions get 503 queue-full"},
    {"config", KIND_FILE, "", 0, 0, 0, "FILE",
     "settings as a JSON object, one member per option"},

    {"admin_key_file", KIND_NOT_YET, "", 0, 0, 0, NULL, NULL},
    {"auth", KIND_NOT_YET, "none", 0, 0, 0, NULL, NULL},
    {"blobs", KIND_NOT_YET, "dir", 0, 0, 0, NULL, NULL},
    {"blobs_file", KIND_NOT_YET, "", 0, 0, 0, NULL, NULL},
    {"course_secret_file", KIND_NOT_YET, "", 0, 0, 0, NULL, NULL},
    {"database", KIND_NOT_YET, "sqlite", 0, 0, 0, NULL, NULL},
    {"database_file", KIND_NOT_YET, "", 0, 0, 0, NULL, NULL},
    {"http", KIND_NOT_YET, "on", 0, 0, 0, NULL, NULL},
    {"isa", KIND_NOT_YET, "auto", 0, 0, 0, NULL, NULL},
    {"keys_file", KIND_NOT_YET, "", 0, 0, 0, NULL, NULL},
    {"max_asset_bytes", KIND_NOT_YET, "", 0, 0, 0, NULL, NULL},
    {"max_queued_per_key", KIND_NOT_YET, "", 0, 0, 0, NULL, NULL},
    {"max_request_bytes", KIND_NOT_YET, "", 0, 0, 0, NULL, NULL},
    {"max_running_per_key", KIND_NOT_YET, "", 0, 0, 0, NULL, NULL},
    {"max_streams", KIND_NOT_YET, "", 0, 0, 0, NULL, NULL},
    {"metrics_auth", KIND_NOT_YET, "none", 0, 0, 0, NULL, NULL},
    {"public_url", KIND_NOT_YET, "", 0, 0, 0, NULL, NULL},
    {"record_retention", KIND_NOT_YET, "", 0, 0, 0, NULL, NULL},
    {"result_retention", KIND_NOT_YET, "", 0, 0, 0, NULL, NULL},
    {"share_cache", KIND_NOT_YET, "off", 0, 0, 0, NULL, NULL},
    {"webhook_hosts", KIND_NOT_YET, "", 0, 0, 0, NULL, NULL},
};

enum { SETTING_COUNT = sizeof settings / sizeof settings[0] };

/* Variables that are ours but no settings, and those that Kubernetes makes for
 * a service named glint. */
static const char *const env_ignored[] = {
    "GLINT_WORKER", "GLINT_IMAGE_MODULE", "GLINT_SERVER",
    "GLINT_BUILD",  "GLINT_SOURCE",
};
static const char *const env_prefixes[] = {"GLINT_PORT", "GLINT_SERVICE_"};

/* Actions: flags without a setting. */
static const char *const actions[] = {"help", "version", "print-config",
                                      "check-config"};
enum action {
    ACTION_HELP,
    ACTION_VERSION,
    ACTION_PRINT,
    ACTION_CHECK,
    ACTION_COUNT
};

/* The value of a setting as text, and where it was said. */
struct source {
    const char *text; /* NULL: not said */
    char origin[ORIGIN_SIZE];
    bool quoted; /* a JSON string, or flag and environment, which are text */
    bool typed;  /* from a file: the JSON type counts */
};

struct reader {
    struct config *config;
    struct source sources[SETTING_COUNT];
    bool wanted[ACTION_COUNT];
    bool usage;   /* a mistake in how it was called */
    bool mistake; /* a mistake in a value */
    struct arena arena;
};

/* --- saying what is wrong --- */

static void
complain(bool *flag, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

static void
complain(bool *flag, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    fputs("glintd: ", stderr);
    vfprintf(stderr, format, args);
    fputc('\n', stderr);
    va_end(args);
    *flag = true;
}

static const struct setting *
find(const char *name)
{
    for (size_t i = 0; i < SETTING_COUNT; i++) {
        if (strcmp(settings[i].name, name) == 0)
            return &settings[i];
    }
    return NULL;
}

/* The nearest setting, or with `flags` the nearest flag, else NULL. */
static const char *
nearest(const char *name, bool flags)
{
    const char *names[SETTING_COUNT + ACTION_COUNT];
    size_t count = 0;
    for (size_t i = 0; i < SETTING_COUNT; i++)
        names[count++] = settings[i].name;
    for (size_t i = 0; flags && i < ACTION_COUNT; i++)
        names[count++] = actions[i];
    return json_did_you_mean(name, names, count);
}

/* --max-spp and max_spp */
static void
swap_char(char *text, char from, char to)
{
    for (; *text != '\0'; text++) {
        if (*text == from)
            *text = to;
    }
}

/* --- sources: flags --- */

static void
flag_unknown(struct reader *r, const char *arg, const char *name)
{
    const char *near = nearest(name, true);
    char hint[64] = "";
    if (near != NULL) {
        snprintf(hint, sizeof hint, ", did you mean --%s?", near);
        swap_char(hint, '_', '-');
    }
    complain(&r->usage, "unknown option %.80s%s", arg, hint);
}

static bool
is_action(struct reader *r, const char *name, const char *value)
{
    for (size_t i = 0; i < ACTION_COUNT; i++) {
        char plain[32];
        snprintf(plain, sizeof plain, "%s", actions[i]);
        swap_char(plain, '-', '_');
        if (strcmp(plain, name) != 0)
            continue;
        if (value != NULL)
            complain(&r->usage, "--%s takes no value", actions[i]);
        r->wanted[i] = true;
        return true;
    }
    return false;
}

/* One option; returns how many arguments it took. */
static int
read_flag(struct reader *r, int left, char **argv)
{
    if (strcmp(argv[0], "-h") == 0)
        argv[0] = "--help";
    if (strncmp(argv[0], "--", 2) != 0 || argv[0][2] == '\0') {
        complain(&r->usage,
                 "unexpected argument '%.80s'; options begin with "
                 "-- (glintd --help)",
                 argv[0]);
        return 1;
    }
    char name[64];
    const char *value = strchr(argv[0], '=');
    size_t len =
        value != NULL ? (size_t)(value - argv[0]) - 2 : strlen(argv[0]) - 2;
    snprintf(name, sizeof name, "%.*s", len < 63 ? (int)len : 63, argv[0] + 2);
    /* Spelt as documented: with dashes. */
    bool dashes = strchr(name, '_') == NULL;
    swap_char(name, '-', '_');
    value = value != NULL ? value + 1 : NULL;
    if (dashes && is_action(r, name, value))
        return 1;
    const struct setting *setting = dashes ? find(name) : NULL;
    if (setting == NULL) {
        if (dashes && strncmp(name, "no_", 3) == 0 && find(name + 3) != NULL &&
            find(name + 3)->kind == KIND_NOT_YET) {
            complain(&r->mistake, "%s is not built yet", argv[0]);
            return 1;
        }
        flag_unknown(r, argv[0], name);
        return 1;
    }
    int taken = 1;
    if (value == NULL && setting->kind == KIND_SWITCH) {
        value = "on";
    } else if (value == NULL) {
        if (left < 2) {
            complain(&r->usage, "%s needs a value", argv[0]);
            return 1;
        }
        value = argv[1];
        taken = 2;
    }
    struct source *source = &r->sources[setting - settings];
    source->text = value;
    snprintf(source->origin, sizeof source->origin, "--%s", setting->name);
    swap_char(source->origin, '_', '-');
    source->quoted = true;
    source->typed = false;
    return taken;
}

/* --- sources: environment --- */

static void
env_name(const struct setting *setting, char name[64])
{
    snprintf(name, 64, "GLINT_%s", setting->name);
    for (char *c = name; *c != '\0'; c++) {
        if (*c >= 'a' && *c <= 'z')
            *c = (char)(*c - 'a' + 'A');
    }
}

static bool
env_is_ours(const char *name, size_t len)
{
    for (size_t i = 0; i < sizeof env_ignored / sizeof env_ignored[0]; i++) {
        if (strlen(env_ignored[i]) == len &&
            strncmp(env_ignored[i], name, len) == 0)
            return true;
    }
    for (size_t i = 0; i < sizeof env_prefixes / sizeof env_prefixes[0]; i++) {
        if (strncmp(env_prefixes[i], name, strlen(env_prefixes[i])) == 0)
            return true;
    }
    for (size_t i = 0; i < SETTING_COUNT; i++) {
        char known[64];
        env_name(&settings[i], known);
        if (strlen(known) == len && strncmp(known, name, len) == 0)
            return true;
    }
    return false;
}

/* An empty variable counts as not set. */
static void
read_env(struct reader *r)
{
    for (size_t i = 0; i < SETTING_COUNT; i++) {
        struct source *source = &r->sources[i];
        char name[64];
        env_name(&settings[i], name);
        const char *value = getenv(name);
        if (source->text != NULL || value == NULL || value[0] == '\0')
            continue;
        source->text = value;
        source->quoted = true;
        snprintf(source->origin, sizeof source->origin, "%s", name);
    }
    for (char **e = environ; e != NULL && *e != NULL; e++) {
        size_t len = strcspn(*e, "=");
        if (strncmp(*e, "GLINT_", 6) == 0 && !env_is_ours(*e, len))
            fprintf(stderr,
                    "glintd: warning: the environment variable %.*s is no "
                    "setting\n",
                    (int)len, *e);
    }
}

/* --- sources: the file --- */

static void
take_member(struct reader *r, const char *path, const char *text,
            const struct json *member)
{
    const struct setting *setting = find(member->key);
    if (setting == NULL || setting->kind == KIND_FILE) {
        const char *near = setting != NULL ? NULL : nearest(member->key, false);
        complain(&r->mistake, "%s:%u:%u: unknown key \"%.60s\"%s%s%s", path,
                 member->key_line, member->key_column, member->key,
                 near != NULL ? ", did you mean \"" : "",
                 near != NULL ? near : "", near != NULL ? "\"?" : "");
        return;
    }
    struct source *source = &r->sources[setting - settings];
    if (source->text != NULL)
        return; /* a flag or the environment goes before */
    source->quoted = member->type == JSON_STRING;
    source->typed = true;
    source->text = source->quoted
                       ? member->string
                       : arena_strndup(&r->arena, text + member->begin,
                                       member->end - member->begin);
    if (source->quoted && strlen(member->string) != member->string_len)
        source->text = NULL;
    snprintf(source->origin, sizeof source->origin, "%s:%u:%u: \"%s\"", path,
             member->line, member->column, setting->name);
    if (source->text == NULL)
        complain(&r->mistake, "%s cannot be read", source->origin);
}

static void
read_file(struct reader *r, const char *path)
{
    struct bytes text = {0};
    struct error err = {0};
    if (!bytes_read_file(&text, path, FILE_BYTES_MAX, &err)) {
        complain(&r->mistake, "%s", err.text);
        bytes_clear(&text);
        return;
    }
    const char *kept =
        arena_strndup(&r->arena, text.data != NULL ? text.data : "", text.len);
    struct error_list *errors = arena_alloc(&r->arena, sizeof *errors);
    size_t len = text.len;
    bytes_clear(&text);
    if (kept == NULL || errors == NULL) {
        complain(&r->mistake, "%s: out of memory", path);
        return;
    }
    errors->arena = &r->arena;
    const struct json *root = json_read(kept, len, NULL, &r->arena, errors);
    for (size_t i = 0; i < errors->count; i++)
        complain(&r->mistake, "%s:%u:%u: %s [%s]", path, errors->items[i].line,
                 errors->items[i].column, errors->items[i].detail,
                 error_code_name(errors->items[i].code));
    if (root == NULL)
        return;
    if (root->type != JSON_OBJECT) {
        complain(&r->mistake,
                 "%s: must be an object with one member per "
                 "option, got %s",
                 path, json_describe(root, &r->arena));
        return;
    }
    for (const struct json *m = root->child; m != NULL; m = m->next)
        take_member(r, path, kept, m);
}

/* --config or GLINT_CONFIG, else the first of the usual places. */
static void
find_file(struct reader *r)
{
    struct source *named = &r->sources[find("config") - settings];
    if (named->text != NULL) {
        read_file(r, named->text);
        return;
    }
    const char *xdg = getenv("XDG_CONFIG_HOME");
    const char *home = getenv("HOME");
    const char *places[3] = {"./glint.json", NULL, "/etc/glint/config.json"};
    if (xdg != NULL && xdg[0] == '/')
        places[1] = arena_printf(&r->arena, "%s/glint/config.json", xdg);
    else if (home != NULL && home[0] == '/')
        places[1] =
            arena_printf(&r->arena, "%s/.config/glint/config.json", home);
    for (size_t i = 0; i < 3; i++) {
        if (places[i] == NULL || access(places[i], F_OK) != 0)
            continue;
        named->text = places[i];
        snprintf(named->origin, sizeof named->origin, "found");
        read_file(r, places[i]);
        return;
    }
}

/* --- values --- */

static unsigned
cores(void)
{
    long count = sysconf(_SC_NPROCESSORS_ONLN);
    return count > 0 ? (unsigned)count : 1;
}

static bool
bad(struct reader *r, const struct source *source, const char *wanted)
{
    complain(&r->mistake, "%s must be %s, got %s%.80s%s", source->origin,
             wanted, source->quoted ? "\"" : "", source->text,
             source->quoted ? "\"" : "");
    return false;
}

/* A number in plain decimal form, also 2e10; false if it is none. */
static bool
read_number(const struct source *source, double *number)
{
    if (source->typed && source->quoted)
        return false; /* "5" in a file is text */
    const char *text = source->text;
    if (text[strspn(text, "+-.0123456789eE")] != '\0' || text[0] == '\0')
        return false;
    char *end;
    errno = 0;
    *number = strtod(text, &end);
    return *end == '\0' && errno == 0 && isfinite(*number);
}

static bool
set_number(struct reader *r, const struct setting *setting,
           const struct source *source)
{
    void *place = (char *)r->config + setting->offset;
    bool whole = setting->kind != KIND_SECONDS;
    double number = 0;
    if (setting->kind == KIND_COUNT && strcmp(source->text, "auto") == 0 &&
        source->quoted) {
        bool workers = setting->offset == AT(workers);
        unsigned few = cores() / 8 > 2 ? cores() / 8 : 2;
        number = workers ? (few < 256 ? few : 256)
                         : (cores() < 1024 ? cores() : 1024);
    } else if (!read_number(source, &number) || number < setting->least ||
               number > setting->most ||
               (whole && number != (double)(uint64_t)number)) {
        char wanted[128];
        snprintf(wanted, sizeof wanted, "%sa %s from %.14g to %.14g",
                 setting->kind == KIND_COUNT ? "auto or " : "",
                 whole ? "whole number" : "number", setting->least,
                 setting->most);
        return bad(r, source, wanted);
    }
    switch (setting->kind) {
    case KIND_COUNT:
    case KIND_UNSIGNED: *(unsigned *)place = (unsigned)number; break;
    case KIND_U32: *(uint32_t *)place = (uint32_t)number; break;
    case KIND_U64: *(uint64_t *)place = (uint64_t)number; break;
    default: *(double *)place = number; break;
    }
    return true;
}

/* The place of `word` among `words`; -1 if it is not there. */
static int
word_index(const char *word, const char *const *words, int count)
{
    for (int i = 0; i < count; i++) {
        if (strcmp(word, words[i]) == 0)
            return i;
    }
    return -1;
}

static bool
set_word(struct reader *r, const struct setting *setting,
         const struct source *source)
{
    static const char *const switches[] = {"off",  "on", "false",
                                           "true", "0",  "1"};
    static const char *const levels[] = {"debug", "info", "warn", "error"};
    static const char *const formats[] = {"auto", "text", "json"};
    void *place = (char *)r->config + setting->offset;
    int i;
    switch (setting->kind) {
    case KIND_SWITCH:
        i = word_index(source->text, switches, 6);
        if (i < 0 || (source->typed && (source->quoted || i / 2 != 1)))
            return bad(r, source,
                       source->typed ? "true or false" : "on or off");
        *(bool *)place = i % 2 == 1;
        return true;
    case KIND_LEVEL:
        i = source->quoted ? word_index(source->text, levels, 4) : -1;
        if (i < 0)
            return bad(r, source, "debug, info, warn or error");
        *(enum log_level *)place = (enum log_level)i;
        return true;
    default:
        i = source->quoted ? word_index(source->text, formats, 3) : -1;
        if (i < 0)
            return bad(r, source, "auto, text or json");
        *(enum log_format *)place = (enum log_format)i;
        return true;
    }
}

static bool
set_path(struct reader *r, const struct setting *setting,
         const struct source *source)
{
    char *place = (char *)r->config + setting->offset;
    size_t size = sizeof r->config->data;
    if (!source->quoted || source->text[0] == '\0' ||
        strlen(source->text) > size - 32)
        return bad(r, source, "a path of 1 to 992 bytes");
    snprintf(place, size, "%s", source->text);
    return true;
}

static bool
read_port(const char *text, uint16_t *port)
{
    size_t len = strlen(text);
    if (len == 0 || len > 5 || strspn(text, "0123456789") != len)
        return false;
    unsigned long value = strtoul(text, NULL, 10);
    *port = (uint16_t)value;
    return value <= 65535;
}

/* 127.0.0.1:8080, [::1]:8080, localhost:8080, :8080 */
static bool
set_address(struct reader *r, const struct source *source)
{
    static const char wanted[] =
        "HOST:PORT with a numeric address or localhost, for example "
        "127.0.0.1:8080, [::1]:8080 or :8080";
    struct config *config = r->config;
    const char *text = source->text;
    if (source->quoted && strncmp(text, "unix:", 5) == 0) {
        complain(&r->mistake, "%s: unix sockets are not built yet",
                 source->origin);
        return false;
    }
    const char *colon = strrchr(text, ':');
    if (!source->quoted || colon == NULL ||
        !read_port(colon + 1, &config->port))
        return bad(r, source, wanted);
    size_t len = (size_t)(colon - text);
    bool six = len >= 2 && text[0] == '[' && text[len - 1] == ']';
    if (six) {
        text++;
        len -= 2;
    }
    if (len >= sizeof config->host)
        return bad(r, source, wanted);
    snprintf(config->host, sizeof config->host, "%.*s", (int)len, text);
    if (!six && (len == 0 || strcmp(config->host, "localhost") == 0))
        snprintf(config->host, sizeof config->host, "127.0.0.1");
    unsigned char bytes[16];
    if (inet_pton(six ? AF_INET6 : AF_INET, config->host, bytes) != 1)
        return bad(r, source, wanted);
    return true;
}

static bool
is_loopback(const char *host)
{
    static const unsigned char mapped[12] = {[10] = 0xff, [11] = 0xff};
    unsigned char bytes[16];
    if (inet_pton(AF_INET, host, bytes) == 1)
        return bytes[0] == 127;
    struct in6_addr six;
    if (inet_pton(AF_INET6, host, &six) != 1)
        return false;
    memcpy(bytes, &six, sizeof bytes);
    return IN6_IS_ADDR_LOOPBACK(&six) ||
           (memcmp(bytes, mapped, sizeof mapped) == 0 && bytes[12] == 127);
}

static void
set_value(struct reader *r, const struct setting *setting,
          const struct source *source)
{
    switch (setting->kind) {
    case KIND_ADDRESS: set_address(r, source); break;
    case KIND_PATH: set_path(r, setting, source); break;
    case KIND_SWITCH:
    case KIND_LEVEL:
    case KIND_FORMAT: set_word(r, setting, source); break;
    case KIND_FILE: break;
    case KIND_NOT_YET:
        /* What it would be without saying so may be said. */
        if (setting->standard[0] == '\0' ||
            strcmp(source->text, setting->standard) != 0)
            complain(&r->mistake, "%s is not built yet", source->origin);
        break;
    default: set_number(r, setting, source); break;
    }
}

static void
set_values(struct reader *r)
{
    for (size_t i = 0; i < SETTING_COUNT; i++) {
        struct source *source = &r->sources[i];
        bool said = source->text != NULL;
        if (!said) {
            source->text = settings[i].standard;
            source->quoted = true;
            snprintf(source->origin, sizeof source->origin, "default");
            /* Text and number alike: a default is never of the wrong type. */
            source->typed = false;
        }
        if (said || settings[i].kind != KIND_NOT_YET)
            set_value(r, &settings[i], source);
    }
}

/* What no single value can tell. */
static void
check_together(struct reader *r)
{
    const struct config *c = r->config;
    if (r->mistake)
        return;
    if (c->default_wait > c->max_wait)
        complain(&r->mistake,
                 "default_wait must be at most max_wait, got %g and %g",
                 c->default_wait, c->max_wait);
    if (!is_loopback(c->host) && !c->insecure_open)
        complain(&r->mistake,
                 "listening on %s lets everyone who reaches this machine "
                 "render, read and delete, for keys are not built yet; listen "
                 "on 127.0.0.1, or say --insecure-open if that is meant",
                 c->host);
}

/* --- what is printed --- */

static void
print_version(void)
{
    char isa[ISA_SIZE];
    isa_class(isa);
    printf("glintd %s  core build %.12s  %s\n", glint_version, glint_build,
           isa);
}

static void
print_help(void)
{
    fputs("glintd - renders scenes over HTTP\n\n"
          "  glintd                                    http://127.0.0.1:8080, "
          "data in ./glint-data\n"
          "  glintd --listen 127.0.0.1:0 --data /tmp/g  any free port\n"
          "  glintd --config glint.json --print-config  every value and its "
          "origin\n"
          "  GLINT_WORKERS=4 glintd                     every option is also a "
          "variable ...\n"
          "  echo '{\"workers\": 4}' > glint.json         ... and a key of the "
          "file\n\n"
          "A flag goes before the environment, that before the file (--config, "
          "else\n./glint.json, $XDG_CONFIG_HOME/glint/config.json, "
          "/etc/glint/config.json;\nthe first found), that before the default."
          "\n\n",
          stdout);
    for (size_t i = 0; i < SETTING_COUNT; i++) {
        const struct setting *s = &settings[i];
        if (s->kind == KIND_NOT_YET)
            continue;
        char flag[64];
        snprintf(flag, sizeof flag, "--%s%s%s", s->name,
                 s->value != NULL ? " " : "", s->value != NULL ? s->value : "");
        swap_char(flag, '_', '-');
        printf("  %-28s %s", flag, s->help);
        if (s->standard[0] != '\0')
            printf(" [%s]", s->standard);
        putchar('\n');
    }
    fputs("  --print-config               show every value and its origin\n"
          "  --check-config               exit with 0 or, if something is "
          "wrong, 3\n"
          "  --version, --help\n\n"
          "SIGTERM and SIGINT: running jobs have 25 s to finish, the rest "
          "waits for the\nnext start; a second one ends at once. No accepted "
          "job is ever lost.\n"
          "Exit status: 0 stopped as asked, 2 usage, 3 configuration, 1 "
          "anything else.\n",
          stdout);
}

static void
print_config(const struct reader *r)
{
    for (size_t i = 0; i < SETTING_COUNT; i++) {
        const struct setting *s = &settings[i];
        const struct source *source = &r->sources[i];
        if (s->kind == KIND_NOT_YET)
            continue;
        char value[1100];
        snprintf(value, sizeof value, "%s", source->text);
        if (s->kind == KIND_COUNT && strcmp(value, "auto") == 0)
            snprintf(value, sizeof value, "auto = %u",
                     *(const unsigned *)(const void *)((const char *)r->config +
                                                       s->offset));
        else if (value[0] == '\0')
            snprintf(value, sizeof value, "none");
        printf("%-20s %-24s (%s)\n", s->name, value, source->origin);
    }
}

static enum config_wish
conclude(const struct reader *r, int *status)
{
    if (r->wanted[ACTION_HELP] || r->wanted[ACTION_VERSION]) {
        if (r->wanted[ACTION_HELP])
            print_help();
        else
            print_version();
        *status = EXIT_OK;
        return CONFIG_EXIT_OK;
    }
    if (r->usage || r->mistake) {
        *status = r->usage ? EXIT_USAGE : EXIT_CONFIG;
        return CONFIG_EXIT_BAD;
    }
    *status = EXIT_OK;
    if (r->wanted[ACTION_PRINT])
        print_config(r);
    return r->wanted[ACTION_PRINT] || r->wanted[ACTION_CHECK] ? CONFIG_EXIT_OK
                                                              : CONFIG_RUN;
}

enum config_wish
config_read(int argc, char **argv, struct config *config, int *status)
{
    struct reader *r = calloc(1, sizeof *r);
    if (r == NULL) {
        fputs("glintd: out of memory\n", stderr);
        *status = 1;
        return CONFIG_EXIT_BAD;
    }
    *config = (struct config){0};
    r->config = config;
    arena_init(&r->arena, 16 * FILE_BYTES_MAX);
    for (int i = 1; i < argc;)
        i += read_flag(r, argc - i, argv + i);
    /* Help and version answer whatever else is wrong. */
    if (!r->wanted[ACTION_HELP] && !r->wanted[ACTION_VERSION]) {
        read_env(r);
        find_file(r);
        set_values(r);
        check_together(r);
    }
    enum config_wish wish = conclude(r, status);
    arena_clear(&r->arena);
    free(r);
    return wish;
}
