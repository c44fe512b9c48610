#include "host/cli/command.h"

#include <string.h>

/* weft completion SHELL: what the shell must know, written from the tables that the parser reads. */

static void print_options(const weft_field *fields, FILE *out)
{
    for (const weft_field *f = fields; f && f->key; f++)
        fprintf(out, " --%s", f->key);
}

/* One case per command; a two-word command ("calibrate lens") is the case of its first two words. */
static void print_bash(FILE *out)
{
    fputs("# weft completion for bash: eval \"$(weft completion bash)\"\n"
          "_weft() {\n"
          "    local word=\"${COMP_WORDS[COMP_CWORD]}\" options=\"\"\n"
          "    if [[ $word != -* && $COMP_CWORD -le 2 ]]; then\n"
          "        local names=\"\"\n"
          "        case \"$COMP_CWORD:${COMP_WORDS[1]}\" in\n",
          out);
    fputs("        1:*) names=\"", out);
    const char *last = "";
    for (const weft_command *const *c = weft_commands; *c; c++) {
        const size_t n = strcspn((*c)->name, " ");
        if (strncmp(last, (*c)->name, n) != 0 || (last[n] != ' ' && last[n] != '\0'))
            fprintf(out, "%.*s ", (int)n, (*c)->name);
        last = (*c)->name;
    }
    fputs("\" ;;\n", out);
    for (const weft_command *const *c = weft_commands; *c; c++)
        if (strchr((*c)->name, ' '))
            fprintf(out, "        2:%.*s) names=\"$names %s\" ;;&\n", (int)strcspn((*c)->name, " "),
                    (*c)->name, strchr((*c)->name, ' ') + 1);
    fputs("        esac\n"
          "        COMPREPLY=($(compgen -W \"$names\" -- \"$word\"))\n"
          "        [[ ${#COMPREPLY[@]} -gt 0 ]] && return\n"
          "    fi\n"
          "    case \"${COMP_WORDS[1]} ${COMP_WORDS[2]}\" in\n",
          out);
    for (const weft_command *const *c = weft_commands; *c; c++) {
        fprintf(out, "    \"%s\"*) options=\"", (*c)->name);
        print_options((*c)->fields, out);
        print_options(weft_common_fields, out);
        fputs("\" ;;\n", out);
    }
    fputs("    esac\n"
          "    [[ $word == -* ]] && COMPREPLY=($(compgen -W \"$options\" -- \"$word\")) && return\n"
          "    COMPREPLY=($(compgen -f -- \"$word\"))\n"
          "}\n"
          "complete -o filenames -F _weft weft\n",
          out);
}

static weft_err run(const weft_invocation *inv, const void *args, weft_error *err)
{
    (void)args;
    if (strcmp(inv->operands[0], "bash") != 0)
        return weft_fail(err, WEFT_ERR_USAGE, "%s: no such shell here; there is: bash", inv->operands[0]);
    print_bash(inv->out);
    return WEFT_OK;
}

const weft_command weft_cmd_completion = {
    .name = "completion",
    .summary = "print the completion of commands and options for a shell",
    .operands = "SHELL",
    .min_operands = 1,
    .max_operands = 1,
    .details = "SHELL is bash.",
    .example = "eval \"$(weft completion bash)\"",
    .run = run,
};
