"""Files of worlds and robots: XML parser, URI resolution, and the restriction to allowed folders."""
