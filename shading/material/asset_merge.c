#include "shading/material/asset_merge.h"

#include <string.h>

static weft_rad_member *append(weft_rad_member ***tail, const weft_rad_member *member, weft_arena *arena)
{
    weft_rad_member *const copy = weft_arena_alloc(arena, sizeof *copy, NULL);
    if (!copy)
        return NULL;
    *copy = *member;
    copy->next = NULL;
    **tail = copy;
    *tail = &copy->next;
    return copy;
}

static bool is_word(weft_rad_kind kind)
{
    return kind == WEFT_RAD_TEXT || kind == WEFT_RAD_NAME;
}

/* The same property in both: records merge, the rest is replaced by the own value. */
static void merge_member(weft_rad_member *merged, const weft_rad_member *own, weft_arena *arena,
                         weft_diagnostics *diagnostics)
{
    const weft_rad_value *const old = merged->value, *const new = own->value;
    if (old->kind != new->kind && !(is_word(old->kind) && is_word(new->kind))) {
        weft_diagnose(diagnostics, WEFT_SEVERITY_ERROR, own->place, "'%s' is %s here, but %s in '%s'",
                      own->name, weft_rad_kind_name(new->kind), weft_rad_kind_name(old->kind),
                      merged->set_by);
        return;
    }
    if (new->kind != WEFT_RAD_RECORD || new->record.base) {
        merged->value = own->value;
        merged->set_by = own->set_by;
        merged->place = own->place;
        return;
    }
    weft_rad_value *const value = weft_arena_alloc(arena, sizeof *value, NULL);
    if (!value)
        return;
    *value = *new;
    weft_rad_merge(&old->record, &new->record, &value->record, arena, diagnostics);
    merged->value = value;
    merged->set_by = own->set_by;
}

void weft_rad_merge(const weft_rad_record *base, const weft_rad_record *own, weft_rad_record *out,
                    weft_arena *arena, weft_diagnostics *diagnostics)
{
    weft_rad_record merged = {.base = own->base ? own->base : base->base, .base_place = own->base_place};
    weft_rad_member **tail = &merged.members;
    for (const weft_rad_member *m = base->members; m; m = m->next) {
        weft_rad_member *const copy = append(&tail, m, arena);
        const weft_rad_member *const change = weft_rad_find(own, m->name);
        if (copy && change)
            merge_member(copy, change, arena, diagnostics);
    }
    for (const weft_rad_member *m = own->members; m; m = m->next)
        if (!weft_rad_find(base, m->name))
            append(&tail, m, arena);
    *out = merged;
}
