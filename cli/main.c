/* glint - scenes to pictures, at a desk or through a server.
 *
 * This table is the whole command line: parser, help, manual page, completion
 * and docs/cli.md follow from it (`ninja cli_docs` writes the last two). A new
 * command is a row here and a cmd_*.c. */
#include <stdio.h>
#include <string.h>

#include "cli/command.h"
#include "cli/exit.h"
#include "cli/help.h"
#include "cli/output.h"
#include "core/base/isa.h"
#include "core/scene/layer.h"

static const char *const formats[] = {"png", "exr", NULL};
static const char *const bit_depths[] = {"uint8", "uint16", "half", "float",
                                         NULL};
static const char *const color_spaces[] = {"srgb", "linear", NULL};
static const char *const layers[] = {
#define X(id, name, channels, kind) name,
    LAYER_TABLE(X)
#undef X
        NULL};
/* "beauty, depth, ..., " */
#define X(id, name, channels, kind) name ", "
#define LAYER_NAMES                 LAYER_TABLE(X)
static const char *const help_formats[] = {"text", "markdown", "man", NULL};
static const char *const shells[] = {"bash", NULL};

#define SERVER_OPTION                                                          \
    {                                                                          \
        .name = "server", .value = "URL",                                      \
        .help = "ask this glintd; without it the one in GLINT_SERVER"          \
    }
#define QUIET_OPTION                                                           \
    {                                                                          \
        .name = "quiet", .letter = 'q', .help = "print nothing but errors"     \
    }

static const struct option common[] = {
    {.name = "help", .letter = 'h', .help = "show examples and options"},
    {.name = "no-color", .help = "no colours; NO_COLOR says the same"},
    {0},
};

static const struct option no_options[] = {{0}};

static const struct command_example render_examples[] = {
    {"glint render scene.json -o out.png", "render at this desk"},
    {"glint render scene.json -o out.exr --layer beauty --layer depth",
     "floating-point layers in one EXR file"},
    {"glint render scene.json -o out.png --set /film/width=320 --set "
     "/film/height=180",
     "change a number without editing the file"},
    {"glint examples smallest | glint render - -o - > out.png",
     "scene from standard input, picture to standard output"},
    {"glint render scene.json -o out.png --server http://127.0.0.1:8080",
     "the same picture from a server"},
    {0},
};

static const struct option render_options[] = {
    {.name = "output",
     .letter = 'o',
     .value = "FILE",
     .help = "where the picture goes, .png or .exr; - is standard output"},
    {.name = "format",
     .value = "FORMAT",
     .choices = formats,
     .help = "png or exr, where FILE does not tell; a job document's own "
             "format, else png, for -o -"},
    {.name = "layer",
     .value = "NAME",
     .choices = layers,
     .repeatable = true,
     .help = LAYER_NAMES "of which a png holds one; for exr repeat the "
                         "option"},
    {.name = "bit-depth",
     .value = "DEPTH",
     .choices = bit_depths,
     .help = "png: uint8 (default) or uint16; exr: half or float (default)"},
    {.name = "color-space",
     .value = "SPACE",
     .choices = color_spaces,
     .help = "png: srgb (default), or linear for numbers as they are; exr is "
             "always linear"},
    {.name = "set",
     .value = "/POINTER=VALUE",
     .repeatable = true,
     .help = "replace the value at a JSON pointer before rendering; VALUE is "
             "JSON, or else a string; missing members are made"},
    {.name = "threads",
     .value = "N",
     .min = 1,
     .max = 1024,
     .help = "threads at this desk; without it one per core"},
    {.name = "timeout",
     .value = "SECONDS",
     .min = 1,
     .max = 604800,
     .help = "give up after that time, with exit status 6; a server's job goes "
             "on"},
    SERVER_OPTION,
    QUIET_OPTION,
    {0},
};

static const struct command_example lint_examples[] = {
    {"glint lint scene.json", "all errors and likely mistakes of one file"},
    {"glint lint *.json", "of many"},
    {"glint lint --json scene.json", "the same for a program, one line a file"},
    {0},
};

static const struct option lint_options[] = {
    {.name = "json",
     .help = "print one problem body (RFC 9457) per file and line"},
    QUIET_OPTION,
    {0},
};

static const struct command_example examples_examples[] = {
    {"glint examples", "list the built-in scenes"},
    {"glint examples course-table-fresnel > table.json",
     "start a scene of your own from one"},
    {0},
};

static const struct option examples_options[] = {
    {.name = "names", .help = "list the names only"},
    {0},
};

static const struct command_example version_examples[] = {
    {"glint version", "version, build and ISA class"},
    {"glint version --json", "the same for a program"},
    {0},
};

static const struct option version_options[] = {
    {.name = "json", .help = "print one JSON object"},
    {0},
};

static const struct command_example health_examples[] = {
    {"glint health", "is the server of GLINT_SERVER, or on port 8080, ready?"},
    {"glint health --server http://render.example:8080", "or that one?"},
    {0},
};

static const struct option health_options[] = {
    SERVER_OPTION,
    QUIET_OPTION,
    {0},
};

static const struct command_example help_examples[] = {
    {"glint help render", "examples and options of a command"},
    {"glint help exit-codes", "what the exit status says"},
    {0},
};

static const struct option help_options[] = {
    {.name = "format",
     .value = "FORMAT",
     .choices = help_formats,
     .help = "text (default); markdown and man print the whole reference"},
    {0},
};

static const struct command_example completion_examples[] = {
    {"source <(glint completion bash)", "complete words in this shell"},
    {"glint completion bash > ~/.local/share/bash-completion/completions/glint",
     "in every shell from now on"},
    {0},
};

static const struct command commands[] = {
    {.name = "render",
     .arguments = "SCENE -o FILE",
     .summary = "render a scene to a PNG or EXR file",
     .about =
         "SCENE is a scene document, or a job document with a scene and output "
         "settings in it; - reads standard input. Options win over a job's own "
         "settings.\n\n"
         "The render runs in a worker process of its own at this desk, or on a "
         "server with --server or GLINT_SERVER; the picture is the same. The "
         "file is written whole or not at all. Ctrl-C stops the render and "
         "leaves no file, a second one exits at once.\n\n"
         "On a terminal a progress bar is drawn, elsewhere one line every 10 "
         "seconds; -q prints nothing but errors.",
     .examples = render_examples,
     .options = render_options,
     .min_args = 1,
     .max_args = 1,
     .run = cmd_render},
    {.name = "lint",
     .arguments = "FILE...",
     .summary = "find errors and likely mistakes, without rendering",
     .about = "Each FILE is a scene or job document; - reads standard input. "
              "Every error is shown with its line, and all at once; warnings "
              "never block. The findings go to standard output. The exit "
              "status is 1 if there is an error, 2 if a file cannot be read.",
     .examples = lint_examples,
     .options = lint_options,
     .min_args = 1,
     .max_args = (size_t)-1,
     .run = cmd_lint},
    {.name = "examples",
     .arguments = "[NAME]",
     .summary = "list the built-in example scenes, or print one",
     .about = "With a NAME the document itself goes to standard output.",
     .examples = examples_examples,
     .options = examples_options,
     .max_args = 1,
     .run = cmd_examples},
    {.name = "version",
     .arguments = "",
     .summary = "print version, core build and ISA class",
     .about = "Two programs with one build and one ISA class render the same "
              "scene to the same bytes.",
     .examples = version_examples,
     .options = version_options,
     .run = cmd_version},
    {.name = "health",
     .arguments = "",
     .summary = "ask a server whether it is ready",
     .about = "Asks /readyz of --server, else of GLINT_SERVER, else of "
              "http://127.0.0.1:8080. The exit status is 0 if it is ready, and "
              "4 if it is not or cannot be reached: made for container health "
              "checks.",
     .examples = health_examples,
     .options = health_options,
     .run = cmd_health},
    {.name = "help",
     .arguments = "[COMMAND|exit-codes]",
     .summary = "show how a command is used",
     .about = "Without a name the commands are listed.",
     .examples = help_examples,
     .options = help_options,
     .max_args = 1,
     .run = cmd_help},
    {.name = "completion",
     .arguments = "SHELL",
     .summary = "print a completion script for the shell",
     .about = "SHELL is bash.",
     .examples = completion_examples,
     .options = no_options,
     .min_args = 1,
     .max_args = 1,
     .argument_choices = shells,
     .run = cmd_completion},
};

static const struct program glint = {
    .name = "glint",
    .summary =
        "glint renders scenes to pictures, at a desk or through a server",
    .commands = commands,
    .command_count = sizeof commands / sizeof *commands,
    .common = common,
};

/* `glint --version` is what everybody types first. */
static bool
asks_version(int argc, char **argv)
{
    return argc == 2 &&
           (strcmp(argv[1], "--version") == 0 || strcmp(argv[1], "-V") == 0);
}

static int
run(const struct invocation *in)
{
    if (in->command == NULL) {
        bool asked = invocation_has(in, "help");
        help_overview(asked ? stdout : stderr, in->program);
        return asked ? STATUS_OK : STATUS_USAGE;
    }
    if (invocation_has(in, "help")) {
        help_command(stdout, in->program, in->command);
        return STATUS_OK;
    }
    return in->command->run(in);
}

int
main(int argc, char **argv)
{
    struct invocation in = {0};
    struct error err = {0};
    int status = STATUS_USAGE;

    if (asks_version(argc, argv)) {
        printf("glint %s\n", glint_version);
        status = STATUS_OK;
    } else if (!invocation_read(&in, &glint, argc, argv, &err)) {
        struct channel to = channel_open(stderr, false);
        say_error(&to, "glint", "%s", err.text);
        if (in.command != NULL)
            fprintf(stderr, "usage: glint %s %s; 'glint help %s' shows more\n",
                    in.command->name, in.command->arguments, in.command->name);
    } else {
        status = run(&in);
    }
    invocation_clear(&in);
    /* A full disk must not pass for success. */
    if ((fflush(stdout) != 0 || ferror(stdout)) && status == STATUS_OK) {
        fprintf(stderr, "glint: cannot write to standard output\n");
        status = STATUS_USAGE;
    }
    return status;
}
