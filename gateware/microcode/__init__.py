"""From a schedule to the memories of a core: image, proof."""
