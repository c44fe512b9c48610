/*
 * virtual_controller FIRMWARE|none [BOOTLOADER]: the light controller alone, for tests of programs.  Prints
 * the pty; then answers lines on stdin until it ends: "lights" (mask, seconds of simulated time that they
 * have been dark), "reset", "power" (goes and comes back), "wear ADDRESS" (a byte of the flash memory
 * breaks), "camera DELAY_US EXPOSURE_US" (one on trigger and exposure line; 0 0: none).
 */
#include "host/rig/controller_sim.h"

#include <stdio.h>
#include <string.h>

int main(int argc, char **argv)
{
    weft_controller_sim *sim = NULL;
    weft_error error = {0};
    char pty[128], line[64];
    const weft_controller_sim_program program = {
        .firmware = argc > 1 && strcmp(argv[1], "none") != 0 ? argv[1] : NULL,
        .bootloader = argc > 2 ? argv[2] : NULL,
    };
    if (argc < 2 || weft_controller_sim_create_with(&program, &sim, pty, &error) != WEFT_OK) {
        fprintf(stderr, "virtual_controller: %s\n", error.text);
        return 1;
    }
    printf("%s\n", pty);
    fflush(stdout);
    while (fgets(line, sizeof line, stdin)) {
        double dark_s;
        unsigned delay_us, exposure_us, address;
        if (sscanf(line, "camera %u %u", &delay_us, &exposure_us) == 2)
            weft_controller_sim_set_camera(sim, delay_us, exposure_us);
        if (strcmp(line, "reset\n") == 0)
            weft_controller_sim_reset(sim);
        if (strcmp(line, "power\n") == 0)
            weft_controller_sim_power_cycle(sim);
        if (sscanf(line, "wear %u", &address) == 1)
            weft_controller_sim_wear_out(sim, address);
        const unsigned lights = weft_controller_sim_lights(sim, &dark_s);
        printf("%u %.3f\n", lights, dark_s);
        fflush(stdout);
    }
    weft_controller_sim_destroy(sim);
    return 0;
}
