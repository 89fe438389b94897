"""Files that worlds and robots refer to: an XML parser, URI resolution, and the restriction to allowed folders."""
