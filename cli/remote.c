#include "cli/remote.h"

#include <ctype.h>
#include <curl/curl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "cli/interrupt.h"
#include "core/base/clock.h"
#include "core/base/isa.h"

enum { CONNECT_S = 10, BODY_MAX_MB = 4096 };

struct remote {
    CURLM *multi;
    CURL *easy;
    char base[512]; /* without a slash at the end */
    char trouble[CURL_ERROR_SIZE];
    bool local; /* this machine: no proxy stands between */
};

const char *
remote_server(const char *option)
{
    if (option != NULL)
        return option;
    const char *named = getenv("GLINT_SERVER");
    return named != NULL && *named != '\0' ? named : NULL;
}

/* Is the URL's host this machine? */
static bool
is_loopback(const char *url)
{
    static const char *const hosts[] = {"localhost", "127.0.0.1", "[::1]"};
    const char *host = strstr(url, "://") + 3;
    for (size_t i = 0; i < sizeof hosts / sizeof *hosts; i++) {
        size_t len = strlen(hosts[i]);
        if (strncasecmp(host, hosts[i], len) == 0 &&
            (host[len] == '\0' || host[len] == ':' || host[len] == '/'))
            return true;
    }
    return false;
}

static bool
check_url(struct remote *remote, const char *url, struct error *err)
{
    bool known = strncasecmp(url, "http://", 7) == 0 ||
                 strncasecmp(url, "https://", 8) == 0;
    if (!known)
        return error_set(err, ERROR_USAGE,
                         "the server '%.100s' must be a URL like "
                         "http://127.0.0.1:8080",
                         url);
    if (strpbrk(url, "?#") != NULL || strlen(url) >= sizeof remote->base)
        return error_set(err, ERROR_USAGE,
                         "the server '%.100s' must be a URL without query, "
                         "shorter than %zu bytes",
                         url, sizeof remote->base);
    CURLU *parts = curl_url();
    if (parts == NULL)
        return error_set(err, ERROR_MEMORY, "no memory for a connection");
    CURLUcode code = curl_url_set(parts, CURLUPART_URL, url, 0);
    curl_url_cleanup(parts);
    if (code != CURLUE_OK)
        return error_set(err, ERROR_USAGE,
                         "the server '%.100s' is no valid URL", url);
    snprintf(remote->base, sizeof remote->base, "%s", url);
    size_t len = strlen(remote->base);
    while (len > 0 && remote->base[len - 1] == '/')
        remote->base[--len] = '\0';
    remote->local = is_loopback(remote->base);
    return true;
}

struct remote *
remote_open(const char *url, struct error *err)
{
    struct remote *remote = calloc(1, sizeof *remote);
    if (remote == NULL) {
        error_set(err, ERROR_MEMORY, "no memory for a connection");
        return NULL;
    }
    if (curl_global_init(CURL_GLOBAL_DEFAULT) != 0 ||
        (remote->multi = curl_multi_init()) == NULL ||
        (remote->easy = curl_easy_init()) == NULL) {
        error_set(err, ERROR_MEMORY, "no memory for a connection");
        goto out;
    }
    if (check_url(remote, url, err))
        return remote;
out:
    remote_close(remote);
    return NULL;
}

void
remote_close(struct remote *remote)
{
    if (remote == NULL)
        return;
    curl_easy_cleanup(remote->easy);
    curl_multi_cleanup(remote->multi);
    curl_global_cleanup();
    free(remote);
}

static size_t
on_body(char *data, size_t size, size_t count, void *user)
{
    struct remote_reply *reply = user;
    size_t len = size * count;
    if (reply->body.len + len > (size_t)BODY_MAX_MB << 20)
        return 0;
    bytes_append(&reply->body, data, len);
    return reply->body.failed ? 0 : len;
}

/* Copy a header's value without the blanks around it, if it is that header. */
static bool
header_value(const char *line, size_t len, const char *name, char *value,
             size_t size)
{
    size_t name_len = strlen(name);
    if (len <= name_len || strncasecmp(line, name, name_len) != 0 ||
        line[name_len] != ':')
        return false;
    const char *from = line + name_len + 1, *end = line + len;
    while (from < end && isspace((unsigned char)*from))
        from++;
    while (end > from && isspace((unsigned char)end[-1]))
        end--;
    if ((size_t)(end - from) >= size)
        return false;
    memcpy(value, from, (size_t)(end - from));
    value[end - from] = '\0';
    return true;
}

static size_t
on_header(char *line, size_t size, size_t count, void *user)
{
    struct remote_reply *reply = user;
    size_t len = size * count;
    char value[256];
    if (header_value(line, len, "content-type", value, sizeof value)) {
        value[strcspn(value, "; ")] = '\0';
        snprintf(reply->media_type, sizeof reply->media_type, "%.63s", value);
    } else if (header_value(line, len, "location", value, sizeof value)) {
        /* Only the path counts: the host is the one we asked. */
        const char *path = strstr(value, "://");
        path = path != NULL ? strchr(path + 3, '/') : value;
        snprintf(reply->location, sizeof reply->location, "%s",
                 path != NULL ? path : "");
    } else if (header_value(line, len, "retry-after", value, sizeof value)) {
        double seconds = strtod(value, NULL);
        if (seconds > 0 && seconds < 86400)
            reply->retry_after = seconds;
    }
    return len;
}

static void
set_options(struct remote *remote, const struct remote_ask *ask,
            const char *url, struct curl_slist *headers,
            struct remote_reply *reply)
{
    CURL *easy = remote->easy;
    char agent[64];
    snprintf(agent, sizeof agent, "glint/%s", glint_version);

    curl_easy_reset(easy);
    curl_easy_setopt(easy, CURLOPT_URL, url);
    curl_easy_setopt(easy, CURLOPT_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(easy, CURLOPT_FOLLOWLOCATION, 0L);
    curl_easy_setopt(easy, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(easy, CURLOPT_USERAGENT, agent);
    curl_easy_setopt(easy, CURLOPT_ERRORBUFFER, remote->trouble);
    curl_easy_setopt(easy, CURLOPT_CONNECTTIMEOUT, (long)CONNECT_S);
    curl_easy_setopt(easy, CURLOPT_TIMEOUT_MS, (long)(ask->timeout_s * 1000));
    curl_easy_setopt(easy, CURLOPT_CUSTOMREQUEST, ask->method);
    curl_easy_setopt(easy, CURLOPT_HTTPHEADER, headers);
    curl_easy_setopt(easy, CURLOPT_WRITEFUNCTION, on_body);
    curl_easy_setopt(easy, CURLOPT_WRITEDATA, reply);
    curl_easy_setopt(easy, CURLOPT_HEADERFUNCTION, on_header);
    curl_easy_setopt(easy, CURLOPT_HEADERDATA, reply);
    if (remote->local)
        curl_easy_setopt(easy, CURLOPT_PROXY, "");
    if (ask->body != NULL) {
        curl_easy_setopt(easy, CURLOPT_POSTFIELDSIZE_LARGE,
                         (curl_off_t)ask->body->len);
        curl_easy_setopt(easy, CURLOPT_POSTFIELDS,
                         ask->body->data ? ask->body->data : "");
    }
}

/* Let curl work until the transfer ends; Ctrl-C wakes the wait at once. */
static bool
transfer(struct remote *remote, double grace_s, CURLcode *code)
{
    int running = 1;
    int64_t until_us = 0; /* set when interrupted */
    while (running > 0) {
        int64_t now_us = clock_monotonic_us();
        if (interrupted() && until_us == 0)
            until_us = now_us + (int64_t)(grace_s * 1e6);
        if (until_us > 0 && now_us >= until_us)
            return false;
        if (curl_multi_perform(remote->multi, &running) != CURLM_OK)
            break;
        /* Once noticed the event stays readable: look no more. */
        struct curl_waitfd event = {.fd = interrupt_fd(),
                                    .events = CURL_WAIT_POLLIN};
        unsigned extra = until_us == 0 && event.fd >= 0 ? 1 : 0;
        int64_t left_ms = until_us > 0 ? (until_us - now_us) / 1000 + 1 : 1000;
        if (running > 0)
            curl_multi_poll(remote->multi, &event, extra,
                            left_ms < 1000 ? (int)left_ms : 1000, NULL);
    }
    int left;
    CURLMsg *message;
    *code = CURLE_SEND_ERROR;
    while ((message = curl_multi_info_read(remote->multi, &left)) != NULL) {
        if (message->msg == CURLMSG_DONE)
            *code = message->data.result;
    }
    return true;
}

static bool
explain(const struct remote *remote, const struct remote_ask *ask,
        CURLcode code, struct error *err)
{
    const char *why =
        remote->trouble[0] ? remote->trouble : curl_easy_strerror(code);
    switch (code) {
    case CURLE_COULDNT_CONNECT:
        return error_set(err, ERROR_IO,
                         "nobody listens at %s: is glintd running? start it "
                         "with: glintd",
                         remote->base);
    case CURLE_COULDNT_RESOLVE_HOST:
        return error_set(err, ERROR_IO, "no machine has the name in %s",
                         remote->base);
    case CURLE_OPERATION_TIMEDOUT:
        return error_set(err, ERROR_TIMEOUT, "%s did not answer within %.0f s",
                         remote->base, ask->timeout_s);
    case CURLE_WRITE_ERROR:
        return error_set(err, ERROR_IO, "the answer of %s is too large",
                         remote->base);
    default:
        return error_set(err, ERROR_IO, "cannot ask %s: %s", remote->base, why);
    }
}

bool
remote_send(struct remote *remote, const struct remote_ask *ask,
            struct remote_reply *reply, struct error *err)
{
    struct curl_slist *headers = NULL;
    char url[1024];
    bool ok = false;

    *reply = (struct remote_reply){0};
    remote->trouble[0] = '\0';
    snprintf(url, sizeof url, "%s%s", remote->base, ask->path);
    /* No 100-continue: it costs a round trip and no glintd needs it. */
    headers = curl_slist_append(NULL, "Expect:");
    for (const char *const *h = ask->headers; h != NULL && *h != NULL; h++)
        headers = curl_slist_append(headers, *h);
    set_options(remote, ask, url, headers, reply);

    CURLcode code;
    curl_multi_add_handle(remote->multi, remote->easy);
    bool whole = transfer(remote, ask->grace_s, &code);
    curl_multi_remove_handle(remote->multi, remote->easy);
    if (!whole) {
        error_set(err, ERROR_CANCELED, "interrupted");
        goto out;
    }
    if (code != CURLE_OK) {
        explain(remote, ask, code, err);
        goto out;
    }
    curl_easy_getinfo(remote->easy, CURLINFO_RESPONSE_CODE, &reply->status);
    ok = true;
out:
    curl_slist_free_all(headers);
    if (!ok)
        remote_reply_clear(reply);
    return ok;
}

void
remote_reply_clear(struct remote_reply *reply)
{
    bytes_clear(&reply->body);
    *reply = (struct remote_reply){0};
}
