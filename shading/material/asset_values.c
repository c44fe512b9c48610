#include "shading/material/asset.h"

#include <string.h>

const weft_rad_member *weft_rad_at(const weft_rad_record *record, const char *path)
{
    for (;;) {
        const size_t n = strcspn(path, ".");
        const weft_rad_member *m = record->members;
        while (m && (strlen(m->name) != n || memcmp(m->name, path, n) != 0))
            m = m->next;
        if (!m || path[n] == '\0')
            return m;
        path += n + 1;
        record = &m->value->record;
    }
}

static const weft_rad_value *value_at(const weft_rad_record *record, const char *path, weft_rad_kind kind)
{
    const weft_rad_member *const m = weft_rad_at(record, path);
    return m && m->value->kind == kind ? m->value : NULL;
}

double weft_rad_number(const weft_rad_record *record, const char *path, double absent)
{
    const weft_rad_value *const value = value_at(record, path, WEFT_RAD_NUMBER);
    return value ? value->number : absent;
}

bool weft_rad_flag(const weft_rad_record *record, const char *path, bool absent)
{
    const weft_rad_value *const value = value_at(record, path, WEFT_RAD_FLAG);
    return value ? value->flag : absent;
}

const char *weft_rad_text(const weft_rad_record *record, const char *path, const char *absent)
{
    const weft_rad_member *const m = weft_rad_at(record, path);
    return m && (m->value->kind == WEFT_RAD_TEXT || m->value->kind == WEFT_RAD_NAME) ? m->value->text
                                                                                     : absent;
}

void weft_rad_colour(const weft_rad_record *record, const char *path, double absent, double rgb[3])
{
    const weft_rad_value *const value = value_at(record, path, WEFT_RAD_RECORD);
    static const char *const components[3] = {"r", "g", "b"};
    for (int c = 0; c < 3; c++)
        rgb[c] = value ? weft_rad_number(&value->record, components[c], absent) : absent;
}

int weft_rad_numbers(const weft_rad_record *record, const char *path, int n, double *values)
{
    const weft_rad_value *const list = value_at(record, path, WEFT_RAD_LIST);
    int count = 0;
    for (const weft_rad_value *item = list ? list->items : NULL; item && count < n; item = item->next)
        values[count++] = item->number;
    return count;
}

static void print_plain(const weft_rad_value *value, FILE *out)
{
    switch (value->kind) {
    case WEFT_RAD_FLAG:
        fputs(value->flag ? "true" : "false", out);
        break;
    case WEFT_RAD_TEXT:
        fprintf(out, "\"%s\"", value->text);
        break;
    case WEFT_RAD_LIST:
        fputc('[', out);
        for (const weft_rad_value *item = value->items; item; item = item->next) {
            print_plain(item, out);
            fputs(item->next ? ", " : "", out);
        }
        fputc(']', out);
        break;
    case WEFT_RAD_RECORD:
        fprintf(out, "(%s%s", value->record.base ? " " : "", value->record.base ? value->record.base : "");
        for (const weft_rad_member *m = value->record.members; m; m = m->next) {
            fprintf(out, " :%s = ", m->name);
            print_plain(m->value, out);
        }
        fputs(" )", out);
        break;
    case WEFT_RAD_NUMBER:
    case WEFT_RAD_COLOUR:
    case WEFT_RAD_NAME:
        fputs(value->text, out);
        break;
    }
}

void weft_asset_print(const weft_asset *asset, FILE *out)
{
    fprintf(out, ":%s := ( %s\n", asset->name, asset->type->name);
    for (const weft_rad_member *m = asset->properties.members; m; m = m->next) {
        fprintf(out, "    :%s = ", m->name);
        print_plain(m->value, out);
        fprintf(out, "  // %s\n", m->set_by);
    }
    fputs(")\n", out);
}
