#include "cli/progress.h"

#include <string.h>

enum {
    BAR_WIDTH = 32,
    BAR_LEAST = 10,
    FIRST_BAR_US = 250 * 1000, /* a shorter render shows no bar */
    LINE_EVERY_US = 10 * 1000 * 1000,
    FACTS_WIDTH = 46 /* all of a line but its bar */
};

static void
format_left(double seconds, char *text, size_t size)
{
    if (seconds < 0 || seconds > 360000) {
        snprintf(text, size, "%s", "");
        return;
    }
    long s = (long)(seconds + 0.5);
    if (s < 3600)
        snprintf(text, size, "  %ld:%02ld left", s / 60, s % 60);
    else
        snprintf(text, size, "  %ld:%02ld:%02ld left", s / 3600, s / 60 % 60,
                 s % 60);
}

static void
format_speed(double rays_per_second, char *text, size_t size)
{
    double mega = rays_per_second / 1e6;
    if (rays_per_second <= 0)
        snprintf(text, size, "%s", "");
    else
        snprintf(text, size, mega < 9.95 ? "  %.1f Mray/s" : "  %.0f Mray/s",
                 mega);
}

size_t
progress_format(char text[PROGRESS_SIZE], const struct progress_facts *facts,
                bool bar, unsigned columns)
{
    char hashes[BAR_WIDTH + 8] = "", speed[48], left[48];
    double fraction = facts->fraction < 0   ? 0
                      : facts->fraction > 1 ? 1
                                            : facts->fraction;
    int percent = (int)(fraction * 100);

    format_speed(facts->rays_per_second, speed, sizeof speed);
    format_left(facts->seconds_left, left, sizeof left);
    int width = (int)columns - FACTS_WIDTH;
    width = width > BAR_WIDTH ? BAR_WIDTH : width;
    if (bar && width >= BAR_LEAST) {
        int full = (int)(fraction * width);
        hashes[0] = '[';
        memset(hashes + 1, '#', (size_t)full);
        memset(hashes + 1 + full, '-', (size_t)(width - full));
        memcpy(hashes + 1 + width, "] ", 3);
    }
    snprintf(text, PROGRESS_SIZE, "%-8s %s%3d%%%s%s", facts->stage, hashes,
             percent, speed, left);
    if (bar && columns > 0 && strlen(text) >= columns)
        text[columns - 1] = '\0';
    return strlen(text);
}

void
progress_start(struct progress *progress, const struct channel *to, bool quiet,
               int64_t now_us)
{
    *progress = (struct progress){
        .file = quiet ? NULL : to->file,
        .bar = to->terminal,
        .columns = to->columns,
        .next_us = now_us + (to->terminal ? FIRST_BAR_US : LINE_EVERY_US),
    };
}

/* Draw over the line that is there. Blanks, not escapes, wipe a longer one. */
static void
draw(struct progress *progress, const char *text, size_t len)
{
    size_t blanks = progress->drawn > len ? progress->drawn - len : 0;
    fprintf(progress->file, "\r%s%*s", text, (int)blanks, "");
    fflush(progress->file);
    progress->drawn = len > progress->drawn ? len : progress->drawn;
}

void
progress_show(struct progress *progress, const struct progress_facts *facts,
              int64_t now_us)
{
    char text[PROGRESS_SIZE];
    struct progress_facts shown = *facts;

    if (progress->file == NULL)
        return;
    /* A restarted attempt begins anew; what was shown does not fall. */
    if (shown.fraction < progress->most)
        shown.fraction = progress->most;
    progress->most = shown.fraction;
    if (now_us < progress->next_us)
        return;
    size_t len =
        progress_format(text, &shown, progress->bar, progress->columns);
    if (progress->bar) {
        draw(progress, text, len);
        return;
    }
    fprintf(progress->file, "%s\n", text);
    fflush(progress->file);
    progress->next_us = now_us + LINE_EVERY_US;
}

void
progress_finish(struct progress *progress)
{
    if (progress->drawn == 0)
        return;
    char text[PROGRESS_SIZE];
    struct progress_facts done = {
        .stage = "done", .fraction = 1, .seconds_left = -1};
    size_t len = progress_format(text, &done, true, progress->columns);
    draw(progress, text, len);
    fputc('\n', progress->file);
    fflush(progress->file);
    progress->drawn = 0;
}

void
progress_erase(struct progress *progress)
{
    if (progress->drawn == 0)
        return;
    /* The terminal may have written ^C behind it. */
    size_t width = progress->drawn + 2;
    if (width >= progress->columns)
        width = progress->columns - 1;
    fprintf(progress->file, "\r%*s\r", (int)width, "");
    fflush(progress->file);
    progress->drawn = 0;
}
