"""From a schedule to the memories of a core: words, image, listing, and an emulator of them."""
