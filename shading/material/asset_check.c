#include "shading/material/asset_check.h"

#include "core/fields.h"

#include <string.h>

typedef struct checker {
    const weft_property *const *tables;
    unsigned model;
    const char *set_by;
    weft_arena *arena;
    weft_diagnostics *diagnostics;
} checker;

static void wrong_kind(const checker *c, const weft_rad_value *value, const char *name, const char *wanted)
{
    weft_diagnose(c->diagnostics, WEFT_SEVERITY_ERROR, value->place, "%s is %s, not %s", name, wanted,
                  weft_rad_kind_name(value->kind));
}

static void check_range(const checker *c, const weft_rad_value *value, const weft_property *row)
{
    if (value->number < row->min || value->number > row->max)
        weft_diagnose(c->diagnostics, WEFT_SEVERITY_ERROR, value->place, "%s is %g to %g%s%s, not %s",
                      row->name, row->min, row->max, row->unit ? " " : "", row->unit ? row->unit : "",
                      value->text);
}

static void check_choice(const checker *c, weft_rad_value *value, const weft_property *row)
{
    if (value->kind != WEFT_RAD_NAME && value->kind != WEFT_RAD_TEXT) {
        wrong_kind(c, value, row->name, row->choices);
        return;
    }
    const size_t n = strlen(value->text);
    char nearest[64] = "";
    int least = 1 + (int)n / 2;
    for (const char *word = row->choices; word; word = strchr(word, '|')) {
        word += *word == '|';
        const size_t length = strcspn(word, "|");
        if (length == n && memcmp(word, value->text, n) == 0)
            return;
        char one[64];
        (void)snprintf(one, sizeof one, "%.*s", (int)length, word);
        if (weft_text_distance(one, value->text) < least) {
            least = weft_text_distance(one, value->text);
            memcpy(nearest, one, sizeof nearest);
        }
    }
    weft_diagnose(c->diagnostics, WEFT_SEVERITY_ERROR, value->place, "%s is one of %s, not '%s'%s%s%s",
                  row->name, row->choices, value->text, *nearest ? "; did you mean '" : "", nearest,
                  *nearest ? "'?" : "");
}

static void check_numbers(const checker *c, const weft_rad_value *value, const weft_property *row)
{
    if (value->kind != WEFT_RAD_LIST) {
        wrong_kind(c, value, row->name, weft_property_type_name(row->type));
        return;
    }
    for (const weft_rad_value *item = value->items; item; item = item->next)
        if (item->kind != WEFT_RAD_NUMBER)
            wrong_kind(c, item, row->name, "made of numbers");
        else
            check_range(c, item, row);
}

static const char *const components[3] = {"r", "g", "b"};

/* One component of a colour as a member of its record. */
static bool add_component(const checker *c, weft_rad_value *colour, int k, double number, const char *spelt,
                          weft_place place)
{
    weft_rad_member *const member = weft_arena_alloc(c->arena, sizeof *member, NULL);
    weft_rad_value *const value = weft_arena_alloc(c->arena, sizeof *value, NULL);
    if (!member || !value)
        return false;
    *value = (weft_rad_value){.kind = WEFT_RAD_NUMBER, .place = place, .number = number, .text = spelt};
    if (!spelt)
        value->text = weft_arena_printf(c->arena, NULL, "%.6g", number);
    *member = (weft_rad_member){.name = components[k], .place = place, .value = value, .set_by = c->set_by};
    weft_rad_member **tail = &colour->record.members;
    while (*tail)
        tail = &(*tail)->next;
    *tail = member;
    return true;
}

static void check_colour_record(const checker *c, weft_rad_value *value, const weft_property *row)
{
    for (weft_rad_member *m = value->record.members; m; m = m->next) {
        m->set_by = c->set_by;
        if (strcmp(m->name, "r") != 0 && strcmp(m->name, "g") != 0 && strcmp(m->name, "b") != 0)
            weft_diagnose(c->diagnostics, WEFT_SEVERITY_ERROR, m->place,
                          "a colour has :r, :g and :b, not '%s'", m->name);
        else if (m->value->kind != WEFT_RAD_NUMBER)
            wrong_kind(c, m->value, m->name, "a number");
        else
            check_range(c, m->value, row);
    }
}

/* All spellings of a colour become a record of its components. */
static void check_colour(const checker *c, weft_rad_value *value, const weft_property *row)
{
    const weft_rad_value written = *value;
    if (written.kind == WEFT_RAD_RECORD) {
        check_colour_record(c, value, row);
        return;
    }
    int n = 0;
    double rgb[3] = {written.number, written.number, written.number};
    const char *spelt[3] = {NULL, NULL, NULL};
    if (written.kind == WEFT_RAD_COLOUR) {
        memcpy(rgb, written.colour, sizeof rgb);
    } else if (written.kind == WEFT_RAD_LIST) {
        for (const weft_rad_value *item = written.items; item; item = item->next, n++)
            if (n < 3 && item->kind == WEFT_RAD_NUMBER) {
                rgb[n] = item->number;
                spelt[n] = item->text;
            } else {
                n = 3;
            }
        if (n != 3) {
            weft_diagnose(c->diagnostics, WEFT_SEVERITY_ERROR, value->place,
                          "%s is a colour: three numbers [r, g, b], (:r :g :b) or #rrggbb", row->name);
            return;
        }
    } else if (written.kind != WEFT_RAD_NUMBER) {
        wrong_kind(c, value, row->name, weft_property_type_name(row->type));
        return;
    }
    *value = (weft_rad_value){.kind = WEFT_RAD_RECORD, .place = written.place};
    for (int k = 0; k < 3; k++) {
        if (rgb[k] < row->min || rgb[k] > row->max)
            weft_diagnose(c->diagnostics, WEFT_SEVERITY_ERROR, written.place, "%s is %g to %g, not %g",
                          row->name, row->min, row->max, rgb[k]);
        add_component(c, value, k, rgb[k], spelt[k], written.place);
    }
}

static void check_layers(const checker *c, weft_rad_value *value, const weft_property *row)
{
    if (value->kind != WEFT_RAD_LIST) {
        wrong_kind(c, value, row->name, weft_property_type_name(row->type));
        return;
    }
    for (weft_rad_value *item = value->items; item; item = item->next) {
        if (item->kind != WEFT_RAD_RECORD || !item->record.base) {
            weft_diagnose(c->diagnostics, WEFT_SEVERITY_ERROR, item->place,
                          "a layer is a record that begins with its material: ( cotton :alpha = 0.5 )");
            continue;
        }
        const weft_property *const tables[2] = {row->members, weft_material_properties};
        weft_asset_check(&item->record, tables, WEFT_MATERIAL_ANY, c->set_by, c->arena, c->diagnostics);
    }
}

static void check_value(const checker *c, weft_rad_value *value, const weft_property *row)
{
    static const struct {
        weft_property_type type;
        weft_rad_kind kind;
    } plain[] = {{WEFT_PROPERTY_FLAG, WEFT_RAD_FLAG},
                 {WEFT_PROPERTY_NUMBER, WEFT_RAD_NUMBER},
                 {WEFT_PROPERTY_TEXT, WEFT_RAD_TEXT},
                 {WEFT_PROPERTY_RECORD, WEFT_RAD_RECORD}};
    for (size_t i = 0; i < sizeof plain / sizeof plain[0]; i++)
        if (plain[i].type == row->type && plain[i].kind != value->kind) {
            wrong_kind(c, value, row->name, weft_property_type_name(row->type));
            return;
        }
    switch (row->type) {
    case WEFT_PROPERTY_NUMBER:
        check_range(c, value, row);
        break;
    case WEFT_PROPERTY_COLOUR:
        check_colour(c, value, row);
        break;
    case WEFT_PROPERTY_CHOICE:
        check_choice(c, value, row);
        break;
    case WEFT_PROPERTY_NUMBERS:
        check_numbers(c, value, row);
        break;
    case WEFT_PROPERTY_LAYERS:
        check_layers(c, value, row);
        break;
    case WEFT_PROPERTY_RECORD: {
        const weft_property *const tables[2] = {row->members, NULL};
        weft_asset_check(&value->record, tables, c->model, c->set_by, c->arena, c->diagnostics);
        break;
    }
    case WEFT_PROPERTY_FLAG:
    case WEFT_PROPERTY_TEXT:
        break;
    }
}

static void warn_unknown(const checker *c, const weft_rad_member *m)
{
    const weft_property *near = NULL;
    for (int t = 0; t < 2 && c->tables[t] && !near; t++)
        near = weft_property_nearest(c->tables[t], c->model, m->name);
    weft_diagnose(c->diagnostics, WEFT_SEVERITY_WARNING, m->place, "nothing reads '%s'%s%s%s", m->name,
                  near ? "; did you mean '" : "", near ? near->name : "", near ? "'?" : "");
}

/* A property nobody knows is kept; its members still say who set them. */
static void mark(weft_rad_record *record, const char *set_by)
{
    for (weft_rad_member *m = record->members; m; m = m->next) {
        m->set_by = set_by;
        mark(&m->value->record, set_by);
    }
}

void weft_asset_check(weft_rad_record *record, const weft_property *const tables[2], unsigned model,
                      const char *set_by, weft_arena *arena, weft_diagnostics *diagnostics)
{
    const checker c = {tables, model, set_by, arena, diagnostics};
    for (weft_rad_member *m = record->members; m; m = m->next) {
        const weft_property *row = weft_property_find(tables[0], m->name);
        if (!row && tables[1])
            row = weft_property_find(tables[1], m->name);
        m->set_by = set_by;
        if (!row) {
            warn_unknown(&c, m);
            mark(&m->value->record, set_by);
            continue;
        }
        m->name = row->name;
        if (row->models && !(row->models & model))
            weft_diagnose(diagnostics, WEFT_SEVERITY_WARNING, m->place,
                          "this type of material does not use '%s'", m->name);
        check_value(&c, m->value, row);
    }
}
