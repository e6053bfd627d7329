"""From a schedule to the memories of a core: words, image, emulator."""
