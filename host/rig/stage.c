#include "host/rig/stage.h"

#include "core/mem.h"
#include "host/rig/sensor.h"

#include <pthread.h>

struct weft_rig_stage {
    weft_rig_scene scene;
    weft_rig_view view;
    pthread_mutex_t lock; /* of what follows */
    weft_rig_sample *sample;
    weft_rig_frames frames;
    uint64_t sequence;
};

static weft_err prepare(const weft_rig_stage *stage, const char *name, weft_rig_sample **sample,
                        weft_rig_frames *frames, weft_error *err)
{
    weft_rig_sample *const made = weft_alloc(1, sizeof *made, err);
    if (!made)
        return WEFT_ERR_NOMEM;
    weft_err status = weft_rig_sample_init(made, &stage->scene, name, err);
    if (status == WEFT_OK)
        status = weft_rig_frames_init(frames, &stage->scene, &stage->view, made, err);
    if (status != WEFT_OK) {
        weft_rig_sample_fini(made);
        weft_free(made);
        return status;
    }
    *sample = made;
    return WEFT_OK;
}

weft_err weft_rig_stage_set_sample(weft_rig_stage *stage, const char *name, weft_error *err)
{
    weft_rig_sample *sample;
    weft_rig_frames frames;
    WEFT_TRY(prepare(stage, name, &sample, &frames, err));
    pthread_mutex_lock(&stage->lock);
    weft_rig_sample *const old_sample = stage->sample;
    weft_rig_frames old_frames = stage->frames;
    stage->sample = sample;
    stage->frames = frames;
    pthread_mutex_unlock(&stage->lock);
    weft_rig_frames_fini(&old_frames);
    if (old_sample)
        weft_rig_sample_fini(old_sample);
    weft_free(old_sample);
    return WEFT_OK;
}

weft_err weft_rig_stage_create(const weft_rig_setup *setup, const char *sample, weft_rig_stage **stage,
                               weft_error *err)
{
    weft_rig_stage *const s = weft_alloc(1, sizeof *s, err);
    if (!s)
        return WEFT_ERR_NOMEM;
    pthread_mutex_init(&s->lock, NULL);
    weft_err status = weft_rig_scene_init(&s->scene, setup, err);
    if (status == WEFT_OK)
        status = weft_rig_view_sensor(&s->view, &s->scene, err);
    if (status == WEFT_OK)
        status = weft_rig_stage_set_sample(s, sample, err);
    if (status != WEFT_OK) {
        weft_rig_stage_destroy(s);
        return status;
    }
    *stage = s;
    return WEFT_OK;
}

void weft_rig_stage_destroy(weft_rig_stage *stage)
{
    if (!stage)
        return;
    weft_rig_frames_fini(&stage->frames);
    if (stage->sample)
        weft_rig_sample_fini(stage->sample);
    weft_free(stage->sample);
    weft_rig_view_fini(&stage->view);
    pthread_mutex_destroy(&stage->lock);
    weft_free(stage);
}

const weft_rig_scene *weft_rig_stage_scene(const weft_rig_stage *stage)
{
    return &stage->scene;
}

const weft_rig_view *weft_rig_stage_view(const weft_rig_stage *stage)
{
    return &stage->view;
}

const weft_rig_sample *weft_rig_stage_sample(const weft_rig_stage *stage)
{
    return stage->sample;
}

void weft_rig_stage_expose(weft_rig_stage *stage, const double on[WEFT_RIG_N_LIGHTS], double exposure_s,
                           double gain, uint16_t *dn)
{
    double power[WEFT_RIG_N_LIGHTS];
    pthread_mutex_lock(&stage->lock);
    for (int i = 0; i < WEFT_RIG_N_LIGHTS; i++)
        power[i] = on[i] * weft_rig_drift(&stage->scene, stage->sample->name, i);
    weft_rig_expose(&stage->scene, &stage->frames, power, exposure_s, gain, stage->sequence++, dn);
    pthread_mutex_unlock(&stage->lock);
}

uint64_t weft_rig_stage_frames(weft_rig_stage *stage)
{
    pthread_mutex_lock(&stage->lock);
    const uint64_t n = stage->sequence;
    pthread_mutex_unlock(&stage->lock);
    return n;
}
