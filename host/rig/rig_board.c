#include "host/rig/rig_board.h"

#include "core/file.h"
#include "core/mem.h"
#include "core/text.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* -- the port ------------------------------------------------------------------------------------------- */

static weft_err make_link(weft_rig_board *board, weft_error *err)
{
    board->link = weft_asprintf(err, "%s/ttyACM%d", board->dev, board->n_plugged);
    if (!board->link)
        return WEFT_ERR_NOMEM;
    (void)unlink(board->link); /* of a rig that was killed */
    if (symlink(board->pty, board->link) != 0)
        return weft_fail_errno(err, WEFT_ERR_IO, "%s: the link to the serial line", board->link);
    board->n_plugged++;
    return WEFT_OK;
}

static void remove_link(weft_rig_board *board)
{
    if (board->link)
        (void)unlink(board->link);
    weft_free(board->link);
    board->link = NULL;
}

weft_err weft_rig_board_begin(weft_rig_board *board, weft_controller_sim *sim, const char *dir,
                              weft_error *err)
{
    board->sim = sim;
    board->dev = weft_path_join(dir, "dev", err);
    if (!board->dev)
        return WEFT_ERR_NOMEM;
    WEFT_TRY(weft_folder_create(board->dev, err));
    return make_link(board, err);
}

void weft_rig_board_end(weft_rig_board *board)
{
    remove_link(board);
    if (board->dev)
        (void)rmdir(board->dev);
    weft_free(board->dev);
    board->dev = NULL;
}

/* -- what it is told ------------------------------------------------------------------------------------ */

enum { MAX_WORDS = 20 };

static json_t *ok(void)
{
    return json_pack("{s:b}", "ok", 1);
}

static json_t *refuse(const char *wanted)
{
    return json_pack("{s:b, s:s}", "ok", 0, "error", wanted);
}

static json_t *unplug(weft_rig_board *board, char **words, int n, bool *moved)
{
    if (n > 1 || (n == 1 && strcmp(words[0], "power") != 0))
        return refuse("wanted: board unplug [power]");
    weft_controller_sim_unplug(board->sim, n == 1);
    remove_link(board);
    board->pty[0] = '\0';
    *moved = true;
    return ok();
}

static json_t *plug(weft_rig_board *board, bool *moved)
{
    weft_error error = {0};
    remove_link(board);
    weft_err status = weft_controller_sim_plug_in(board->sim, board->pty, &error);
    if (status == WEFT_OK)
        status = make_link(board, &error);
    *moved = true;
    if (status != WEFT_OK)
        return refuse(error.text);
    return json_pack("{s:b, s:s, s:s}", "ok", 1, "pty", board->pty, "port", board->link);
}

/* lamp N good|on|off|open, lamp N late US, lamp N as M */
static json_t *break_lamp(weft_rig_board *board, char **words, int n)
{
    static const char *const states[] = {"good", "on", "off", "open", "late", "as"};
    int lamp = -1, number = 0;
    if (n >= 2 && weft_text_to_int(words[0], &lamp) && lamp >= 0 && lamp < WEFT_SIM_N_LIGHTS)
        for (int state = WEFT_SIM_LAMP_GOOD; state <= WEFT_SIM_LAMP_AS; state++) {
            const bool has_number = state >= WEFT_SIM_LAMP_LATE;
            const int most = state == WEFT_SIM_LAMP_AS ? WEFT_SIM_N_LIGHTS - 1 : 1000000;
            if (strcmp(words[1], states[state]) != 0 || n != (has_number ? 3 : 2) ||
                (has_number && !(weft_text_to_int(words[2], &number) && number >= 0 && number <= most)))
                continue;
            weft_controller_sim_set_lamp(board->sim, lamp, (weft_sim_lamp_state)state, (uint32_t)number);
            return ok();
        }
    return refuse("wanted: board lamp 0..9 good, on, off, open, late MICROSECONDS or as LAMP");
}

static bool read_chance(const char *word, double *chance)
{
    return weft_text_to_double(word, chance) && *chance >= 0 && *chance <= 1;
}

/* Pairs of a fault and its rate; "stall" has a time behind it. */
static bool read_faults(char **words, int n, weft_sim_line_faults *faults)
{
    const struct {
        const char *name;
        double *chance;
    } chances[] = {{"drop", &faults->drop},
                   {"flip", &faults->flip},
                   {"repeat", &faults->repeat},
                   {"repeat-frame", &faults->repeat_frame},
                   {"stall", &faults->stall}};
    for (int i = 0; i + 1 < n; i += 2) {
        int which = 0, number = 0;
        while (which < 5 && strcmp(words[i], chances[which].name) != 0)
            which++;
        if (which < 5) {
            if (!read_chance(words[i + 1], chances[which].chance))
                return false;
        } else if (weft_text_to_int(words[i + 1], &number) && number >= 0 && strcmp(words[i], "ms") == 0) {
            faults->stall_ms = number;
        } else if (number >= 0 && strcmp(words[i], "seed") == 0) {
            faults->seed = (uint64_t)number;
        } else {
            return false;
        }
    }
    return n % 2 == 0;
}

static json_t *spoil_line(weft_rig_board *board, char **words, int n)
{
    weft_sim_line_faults faults = {.seed = 1, .stall_ms = 100};
    const bool in = n > 0 && (strcmp(words[0], "in") == 0 || strcmp(words[0], "both") == 0);
    const bool out = n > 0 && (strcmp(words[0], "out") == 0 || strcmp(words[0], "both") == 0);
    if ((!in && !out) || !read_faults(words + 1, n - 1, &faults))
        return refuse(
            "wanted: board line in, out or both, then any of drop P, flip P, repeat P, repeat-frame P, "
            "stall P, ms TIME, seed N; P is 0 to 1, of each byte or frame");
    if (in)
        weft_controller_sim_set_line_faults(board->sim, WEFT_SIM_TO_BOARD, &faults);
    if (out)
        weft_controller_sim_set_line_faults(board->sim, WEFT_SIM_FROM_BOARD, &faults);
    return ok();
}

json_t *weft_rig_board_obey(weft_rig_board *board, const char *text, bool *moved)
{
    char copy[512], *words[MAX_WORDS], *rest = copy;
    int n = 0;
    snprintf(copy, sizeof copy, "%s", text);
    while (n < MAX_WORDS && (words[n] = strsep(&rest, " ")) != NULL)
        n += words[n][0] != '\0';
    const char *const first = n > 0 ? words[0] : "";
    if (strcmp(first, "unplug") == 0)
        return unplug(board, words + 1, n - 1, moved);
    if (strcmp(first, "plug") == 0 && n == 1)
        return plug(board, moved);
    if (strcmp(first, "lamp") == 0)
        return break_lamp(board, words + 1, n - 1);
    if (strcmp(first, "line") == 0)
        return spoil_line(board, words + 1, n - 1);
    if (n != 1 || (strcmp(first, "hang") != 0 && strcmp(first, "reset") != 0))
        return refuse("wanted: board reset, hang, unplug [power], plug, lamp N STATE or line WAY FAULTS");
    if (strcmp(first, "hang") == 0)
        weft_controller_sim_hang(board->sim);
    else
        weft_controller_sim_reset(board->sim);
    return ok();
}
