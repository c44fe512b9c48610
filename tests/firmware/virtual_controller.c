/*
 * virtual_controller ELF: the light controller alone, for tests of programs.  Prints the pty; then answers
 * lines on stdin until it ends: "lights" (mask, seconds of simulated time that they have been dark), "reset",
 * "camera DELAY_US EXPOSURE_US" (one on trigger and exposure line; 0 0: none).
 */
#include "host/rig/controller_sim.h"

#include <stdio.h>
#include <string.h>

int main(int argc, char **argv)
{
    weft_controller_sim *sim = NULL;
    weft_error error = {0};
    char pty[128], line[64];
    if (argc != 2 || weft_controller_sim_create(argv[1], &sim, pty, &error) != WEFT_OK) {
        fprintf(stderr, "virtual_controller ELF: %s\n", error.text);
        return 1;
    }
    printf("%s\n", pty);
    fflush(stdout);
    while (fgets(line, sizeof line, stdin)) {
        double dark_s;
        unsigned delay_us, exposure_us;
        if (sscanf(line, "camera %u %u", &delay_us, &exposure_us) == 2)
            weft_controller_sim_set_camera(sim, delay_us, exposure_us);
        if (strcmp(line, "reset\n") == 0)
            weft_controller_sim_reset(sim);
        const unsigned lights = weft_controller_sim_lights(sim, &dark_s);
        printf("%u %.3f\n", lights, dark_s);
        fflush(stdout);
    }
    weft_controller_sim_destroy(sim);
    return 0;
}
